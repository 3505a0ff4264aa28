"""A surface with a height map in one frame, from which bands of rows can be held out."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_core.algorithms.photometric import smooth_background
from tactile_core.calibration.light_range import undeformed_sample
from tactile_core.calibration.map_rows import MAP_ROWS, MapBlock
from tactile_core.calibration.result import Fold
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Bool, Frame


@dataclass(frozen=True, eq=False)
class PressedMap:
    """A surface with a height map, in one frame.

    Attributes
    ----------
    bands : sequence of MapBlock
        Bands of the complete frame.
    frame : Frame
        The frame as recorded.
    condition : Conditioning
    reference_from_press : bool
        The reference is the large-scale light of the frame itself, not a recording.
    """

    bands: Sequence[MapBlock]
    frame: Frame
    condition: Conditioning
    reference_from_press: bool

    def sample_undeformed(self, condition: Conditioning) -> Press:
        """Training samples of the undeformed gel surface, from a conditioning's reference."""
        return undeformed_sample(self.frame, condition.undeformed, MAP_ROWS.undeformed_pixels)

    def make_fold(self, held_out: Collection[int]) -> Fold[MapBlock] | None:
        """Return the other bands, in a copy of the frame without the held-out ones."""
        hidden = np.logical_or.reduce([self.bands[i].area() for i in held_out])
        condition = self._conditioning(hidden) if self.reference_from_press else self.condition
        target = replace(
            self.bands[0].target, frame=condition.condition_without(self.frame, hidden)
        )
        others = [
            replace(band, target=target) for i, band in enumerate(self.bands) if i not in held_out
        ]
        used = [band for band in others if band.used]
        if not used:
            return None
        undeformed = self.sample_undeformed(condition)
        return Fold(used, condition.undeformed, self.bands.__getitem__, (undeformed,))

    def _conditioning(self, hidden: Bool) -> Conditioning:
        """Return a conditioning whose reference is the light of the pixels that are not hidden."""
        shown = np.where(hidden[..., None], 0, self.frame.pixels)
        light = smooth_background(shown, hidden)
        return self.condition.with_reference(
            replace(self.condition.undeformed, pixels=light, marker_mask=None)
        )
