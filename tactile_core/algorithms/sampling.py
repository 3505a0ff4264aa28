"""Images as coarse as their smoothing allows: what is smooth needs few pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.photometric import AroundMarks, around_marks, planes_of, skin_of

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

_PX_PER_BLUR = 0.75
"""Smoothing over sampling step, standard deviation: an image loses nothing that one would see."""

_SIGMAS = 2.5
"""Half the width of the smoothing's window."""

_ALL: Any = 255  # numbers are compared with as well, which the types do not say


@dataclass(frozen=True)
class Sampling:
    """Smoothing and the coarser grid that holds its result.

    A step of n pixels averages n × n of them, smooths the rest of the way on the coarse grid, where
    every pixel's work is n² times less, and comes back by linear interpolation, whose own smoothing
    is counted in.

    Attributes
    ----------
    step : int
        Side in px of a coarse pixel; 1 keeps all.
    shape : (int, int)
        Rows and columns of the coarse grid.
    blur : float
        Standard deviation of the smoothing on the coarse grid, in its pixels.
    around_px : int
        Side of the neighbourhood that marks are filled from, on the coarse grid; 0 for a skin
        without marks.
    """

    step: int
    shape: tuple[int, int]
    blur: float
    around_px: int

    @classmethod
    def of(cls, shape: tuple[int, int], marks: Bool | None, blur_px: float) -> Self:
        """Sampling of images of some (rows, columns) with about this standard deviation."""
        step = max(1, int(blur_px / _PX_PER_BLUR))
        # An average of n pixels has the variance (n² − 1) / 12, linear interpolation n² / 6.
        variance = blur_px**2 - (step**2 - 1) / 12 - (step**2 / 6 if step > 1 else 0)
        rest = max(0.0, variance) ** 0.5 / step
        rows, columns = (-(-side // step) for side in shape)
        return cls(step, (rows, columns), rest, -(-around_marks(marks) // step))

    def planes(self, pixels: NDArray[Any], marks: Bool | None) -> list[NDArray[Any]]:
        """(H, W, K) intensities → K coarse smooth planes of the same dtype, marks filled."""
        with planes_of(pixels) as whole:
            planes = [self._coarse(plane) for plane in whole]
            if marks is not None and self.around_px:
                # a coarse pixel is of a mark as soon as one of its pixels is
                skin = cv2.compare(self._coarse(skin_of(marks)), _ALL, cv2.CMP_EQ)
                around = AroundMarks(np.asarray(skin, np.uint8), self.around_px)
                planes = [around.filled(plane) for plane in planes]
            return [self._smooth(plane) for plane in planes]

    def enlarged(self, plane: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
        """A coarse plane at the size of the image, in a new array."""
        if self.step == 1:
            return plane.copy()
        size = self.shape[1] * self.step, self.shape[0] * self.step
        whole = cv2.resize(plane, size, interpolation=cv2.INTER_LINEAR)
        return np.ascontiguousarray(whole[: shape[0], : shape[1]])

    def widened(self, plane: NDArray[Any]) -> NDArray[Any]:
        """A coarse plane as wide as the image, and perhaps a little wider, with its own rows."""
        size = self.shape[1] * self.step, self.shape[0]
        return np.asarray(cv2.resize(plane, size, interpolation=cv2.INTER_LINEAR))

    def _smooth(self, plane: NDArray[Any]) -> NDArray[Any]:
        if self.blur == 0:
            return plane.copy()
        side = 2 * max(1, round(_SIGMAS * self.blur)) + 1
        return np.asarray(cv2.GaussianBlur(plane, (side, side), self.blur))

    def _coarse(self, plane: NDArray[Any]) -> NDArray[Any]:
        if self.step == 1:
            return plane
        below, right = (
            coarse * self.step - side for coarse, side in zip(self.shape, plane.shape, strict=True)
        )
        if below or right:
            plane = cv2.copyMakeBorder(plane, 0, below, 0, right, cv2.BORDER_REPLICATE)
        return np.asarray(cv2.resize(plane, self.shape[::-1], interpolation=cv2.INTER_AREA))
