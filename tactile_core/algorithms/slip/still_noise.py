"""Noise of successive imprints, and whether it is steady enough to show changes."""

from __future__ import annotations

from math import inf
from statistics import median


class NOISE:
    """Parameters of the noise."""

    # [mm] RMS motion of the markers below which the surface is still. Source: twice the noise of
    # a marker's motion between two frames, a tenth of a pixel each.
    still_mm = 0.005
    # [count] Still frames in which the noise is judged. Source: a second at 30 Hz; later ones may
    # already show an object that slides steadily.
    first = 30
    # [count] Still frames that are needed to judge it. Source: by hand, the frames before a lift
    # are about five.
    fewest = 4
    # [ratio] Largest median of the noise, relative to its minimum, that is steady. Source: a
    # camera's noise varies by a tenth (recorded lifts), that of a compressed video by 4 to 75
    # (recorded grasps), because each key frame draws the picture anew.
    steady = 2.0


class StillNoise:
    """Variance of the change of one value between frames.

    Attributes
    ----------
    variance : float
        That of the two most similar successive frames so far; infinite before the second frame.
    steady : bool
        Whether it varies little while the surface is still.
    """

    def __init__(self) -> None:
        self.variance = inf
        self.steady = True
        self._still: list[float] = []

    def update(self, change: float, moved_mm: float) -> None:
        """Take the mean squared change of a value, and the RMS motion of the markers."""
        if change == 0:  # a frame that a camera or video repeats has no noise of its own
            return
        self.variance = min(self.variance, change)
        if moved_mm < NOISE.still_mm and len(self._still) < NOISE.first:
            self._still.append(change)
            if len(self._still) >= NOISE.fewest:
                self.steady = median(self._still) <= NOISE.steady * min(self._still)
