"""What is done to each frame of a calibration before anything is read from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tactile_core.conditioning.light_drift import compensated
from tactile_core.conditioning.marker_mask import MarkFinder
from tactile_core.quantities import Bool, Frame, Reference


@dataclass(frozen=True, eq=False)
class Preparation:
    """Finds a frame's marks, and brings its light to the level of the reference.

    Attributes
    ----------
    untouched : Reference
        With its marks.
    finder : MarkFinder or None
        None for a gel without marks.
    follows : bool
        Whether the light is brought to the reference's level.
    """

    untouched: Reference
    finder: MarkFinder | None = None
    follows: bool = True

    @classmethod
    def of(cls, untouched: Reference, finder: MarkFinder | None, follows: bool) -> Self:
        """Find the reference's marks, too."""
        if finder is not None:
            untouched = replace(untouched, marks=finder.find(untouched.pixels))
        return cls(untouched, finder, follows)

    def __call__(self, frame: Frame) -> Frame:
        """Prepare a frame."""
        frame = self._marked(frame)
        return compensated(frame, self.untouched) if self.follows else frame

    def without(self, frame: Frame, hidden: Bool) -> Frame:
        """Prepare a frame of which some pixels may tell nothing, not even of the light's level.

        Where it is hidden the reference shows instead, as if nothing had touched there.
        """
        pixels = np.where(hidden[..., None], self.untouched.pixels, frame.pixels)
        frame = self._marked(replace(frame, pixels=pixels.astype(frame.pixels.dtype)))
        if not self.follows:
            return frame
        unseen = hidden if frame.marks is None else hidden | frame.marks
        return replace(compensated(replace(frame, marks=unseen), self.untouched), marks=frame.marks)

    def _marked(self, frame: Frame) -> Frame:
        if self.finder is None:
            return frame
        return replace(frame, marks=self.finder.find(frame.pixels))
