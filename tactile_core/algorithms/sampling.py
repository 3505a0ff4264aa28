"""Images as coarse as their smoothing allows: what is smooth needs few pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.scratch import borrowed
from tactile_core.algorithms.arrays.shrinking import MOST_CHANNELS, shrunk
from tactile_core.algorithms.arrays.types import Bool
from tactile_core.algorithms.photometric import AroundMarkers, around_markers, bare_mask, planes_of

_PX_PER_BLUR = 0.75
"""Smoothing over sampling step, standard deviation: an image loses nothing that one would see."""

_SIGMAS = 2.5
"""Half the width of the smoothing's window."""

_HALF: Any = 128  # of 255; numbers are compared with as well, which the types do not say


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
        Side of the neighbourhood that markers are filled from, on the coarse grid; 0 for a skin
        without markers.
    """

    step: int
    shape: tuple[int, int]
    blur: float
    around_px: int

    @classmethod
    def of(cls, shape: tuple[int, int], marker_mask: Bool | None, blur_px: float) -> Self:
        """Sampling of images of some (rows, columns) with about this standard deviation."""
        step = max(1, int(blur_px / _PX_PER_BLUR))
        # An average of n pixels has the variance (n² − 1) / 12, linear interpolation n² / 6.
        variance = blur_px**2 - (step**2 - 1) / 12 - (step**2 / 6 if step > 1 else 0)
        rest = max(0.0, variance) ** 0.5 / step
        rows, columns = (-(-side // step) for side in shape)
        return cls(step, (rows, columns), rest, -(-around_markers(marker_mask) // step))

    def smooth(self, pixels: NDArray[Any], marker_mask: Bool | None) -> NDArray[Any]:
        """(H, W, K) intensities → (h, w, K) smooth and coarse, same dtype, markers filled."""
        parts = self._parts(pixels, marker_mask)
        return parts[0] if parts[0].ndim == 3 else np.dstack(parts)

    def planes(self, pixels: NDArray[Any], marker_mask: Bool | None) -> list[NDArray[Any]]:
        """The same as K planes of (h, w)."""
        parts = self._parts(pixels, marker_mask)
        return parts if parts[0].ndim == 2 else [np.asarray(p) for p in cv2.split(parts[0])]

    def _parts(self, pixels: NDArray[Any], marker_mask: Bool | None) -> list[NDArray[Any]]:
        """The smooth image as a whole where OpenCV can work on it so, or its planes."""
        if pixels.flags.c_contiguous and 1 < pixels.shape[2] <= MOST_CHANNELS:
            return self._worked_on([pixels], marker_mask)
        with planes_of(pixels) as planes:
            return self._worked_on(planes, marker_mask)

    def _worked_on(self, parts: list[NDArray[Any]], marker_mask: Bool | None) -> list[NDArray[Any]]:
        if marker_mask is None or not self.around_px:
            return [self._smooth(self._coarse(part)) for part in parts]
        surface = bare_mask(marker_mask)
        share = self._coarse(surface)
        mostly_bare = np.asarray(cv2.compare(share, _HALF, cv2.CMP_GE), np.uint8)
        around = AroundMarkers(mostly_bare, self.around_px)
        small = [self._of_surface(part, surface, share) for part in parts]
        return [self._smooth(around.filled(part)) for part in small]

    def _of_surface(
        self, part: NDArray[Any], surface: NDArray[np.uint8], share: NDArray[np.uint8]
    ) -> NDArray[Any]:
        """Means over what a coarse pixel has of skin, so that none is lost beside markers."""
        with borrowed(part.shape, part.dtype) as bare:
            bare.fill(0)
            cv2.copyTo(part, surface, bare)
            small = self._coarse(bare)
            shares = share.astype(part.dtype)
            if small.ndim == 3:
                shares = np.asarray(cv2.merge([shares] * small.shape[2]))
            return np.asarray(cv2.divide(small, shares, scale=255))

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

    def _smooth(self, part: NDArray[Any]) -> NDArray[Any]:
        if self.blur == 0:
            return part.copy()
        side = 2 * max(1, round(_SIGMAS * self.blur)) + 1
        return np.asarray(cv2.GaussianBlur(part, (side, side), self.blur))

    def _coarse(self, part: NDArray[Any]) -> NDArray[Any]:
        if self.step == 1:
            return part
        below, right = (
            coarse * self.step - side for coarse, side in zip(self.shape, part.shape, strict=False)
        )
        if below or right:
            part = cv2.copyMakeBorder(part, 0, below, 0, right, cv2.BORDER_REPLICATE)
        return shrunk(part, self.shape[::-1])
