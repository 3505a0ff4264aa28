"""What happens to each frame, once, before anything is measured or fitted from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from tactile_core.conditioning.light_drift import DriftFollower
from tactile_core.conditioning.marker_mask import MarkFinder
from tactile_core.interfaces.component import GelImage
from tactile_core.quantities import Bool, Frame, Reference


@dataclass(frozen=True, eq=False)
class Conditioning:
    """Masks a frame's markers, and brings its light to the level of the reference.

    A pipeline and the fitting of a calibration use the same, so that both see the same frame.

    Attributes
    ----------
    reference : Reference or None
        The undeformed sensor, with its markers masked.
    finder : MarkFinder or None
        None for a gel without markers.
    compensates : bool
        Whether changes of the light are compensated; never without a reference.
    """

    reference: Reference | None
    finder: MarkFinder | None = None
    compensates: bool = True

    @classmethod
    def of(cls, build: GelImage, reference: Reference | None, *, compensates: bool) -> Self:
        """Make the conditioning of a sensor build, and mask the reference's markers.

        Raises
        ------
        InputError
            ``markers: auto`` and no reference to find them in.
        """
        return cls(None, MarkFinder.of(build, reference), compensates).against(reference)

    def against(self, reference: Reference | None) -> Self:
        """Return the same with another reference."""
        if reference is not None and reference.marks is None and self.finder is not None:
            reference = replace(reference, marks=self.finder.find(reference.pixels))
        return replace(self, reference=reference)

    def __call__(self, frame: Frame) -> Frame:
        """Condition a frame."""
        return self.compensated(self.masked(frame))

    def masked(self, frame: Frame) -> Frame:
        """Mask a frame's markers, unless they are masked already."""
        if self.finder is None or frame.marks is not None:
            return frame
        return self.finder.marked(frame)

    def compensated(self, frame: Frame) -> Frame:
        """Bring a masked frame to the light of the reference."""
        if self._drift is None:
            return frame
        return self._drift.compensated(frame)

    def without(self, frame: Frame, hidden: Bool) -> Frame:
        """Condition a frame of which some pixels may show nothing, not even the light's level.

        Where it is hidden the reference shows instead, as if nothing had touched there.
        """
        pixels = np.where(hidden[..., None], self.undeformed.pixels, frame.pixels)
        pixels = pixels.astype(frame.pixels.dtype)
        frame = self.masked(replace(frame, pixels=pixels, marks=None, darkness=None))
        unseen = hidden if frame.marks is None else hidden | frame.marks
        return replace(self.compensated(replace(frame, marks=unseen)), marks=frame.marks)

    @property
    def undeformed(self) -> Reference:
        """The reference, where there has to be one."""
        if self.reference is None:
            raise ValueError("there is no reference")
        return self.reference

    @cached_property
    def _drift(self) -> DriftFollower | None:
        if self.reference is None or not self.compensates:
            return None
        return DriftFollower(self.reference)
