"""Bands of a height map's rows, of which some are held out from the frame that shows them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_core.algorithms.background import smooth_background
from tactile_core.calibration.held_out import Fold
from tactile_core.calibration.map_rows import MapBlock
from tactile_core.calibration.presses import at_rest
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Bool, Frame

REST_PIXELS = 300
"""Beside a height map's rows: enough to hold the model level in places that the rows leave out, and
too few to draw its slopes towards nought."""


@dataclass(frozen=True, eq=False)
class PressedMap:
    """A surface whose height map is known, in one frame.

    Attributes
    ----------
    bands : sequence of MapBlock
        On the whole frame.
    frame : Frame
        As it was recorded.
    condition : Conditioning
    stands_in : bool
        The reference is the frame's own large-scale light.
    """

    bands: Sequence[MapBlock]
    frame: Frame
    condition: Conditioning
    stands_in: bool

    def at_rest(self, condition: Conditioning) -> Press:
        """Skin at rest, of the reference of a conditioning."""
        return at_rest(self.frame, condition.undeformed, REST_PIXELS)

    def without(self, held_out: Collection[int]) -> Fold[MapBlock] | None:
        """Return the other bands, in a frame that does not show those held out."""
        hidden = np.logical_or.reduce([self.bands[i].area() for i in held_out])
        condition = self._conditioning(hidden) if self.stands_in else self.condition
        target = replace(self.bands[0].target, frame=condition.without(self.frame, hidden))
        others = [
            replace(band, target=target) for i, band in enumerate(self.bands) if i not in held_out
        ]
        used = [band for band in others if band.used]
        if not used:
            return None
        rest = self.at_rest(condition)
        return Fold(used, condition.undeformed, self.bands.__getitem__, (rest,))

    def _conditioning(self, hidden: Bool) -> Conditioning:
        """With the large-scale light of what is not hidden as reference."""
        shown = np.where(hidden[..., None], 0, self.frame.pixels)
        light = smooth_background(shown, hidden)
        return self.condition.against(
            replace(self.condition.undeformed, pixels=light, marker_mask=None)
        )
