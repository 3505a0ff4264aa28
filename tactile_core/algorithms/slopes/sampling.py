"""Samples an image for the model of colour and slope, where it is valid."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import (
    MOST_CHANNELS,
    interpolate_cells,
    shrink_image,
)
from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.algorithms.light.photometric import (
    AroundMarkers,
    around_markers,
    bare_mask,
    planes_of,
)


@dataclass(frozen=True)
class Sampling:
    """Smoothing, and the coarse grid that holds its result.

    A step of n pixels averages n × n of them and applies the remaining smoothing on the coarse
    grid, at 1/n² of the cost. Linear interpolation returns to the full size; its own smoothing is
    included.

    Attributes
    ----------
    step : int
        Side in px of a coarse pixel; 1 keeps the full resolution.
    shape : (int, int)
        Rows and columns of the coarse grid.
    blur : float
        Standard deviation of the smoothing on the coarse grid, in coarse pixels.
    around_px : int
        Side of the neighbourhood that markers are filled from, in coarse pixels; 0 for a gel
        without markers.
    averaged : bool
        Whether the grid is wider than the smoothing allows; see :meth:`wider`.
    """

    step: int
    shape: tuple[int, int]
    blur: float
    around_px: int
    averaged: bool = False

    @classmethod
    def for_shape(
        cls,
        shape: tuple[int, int],
        marker_mask: Bool | None,
        blur_px: float,
    ) -> Self:
        """Choose the grid for images of (rows, columns) and about this standard deviation."""
        # [steps] The errors of the normals of recorded balls stay within 0.1° of those at every
        # pixel (ADR 6)
        step = max(1, int(blur_px / 0.75))
        # An average of n pixels has the variance (n² − 1) / 12, linear interpolation n² / 6.
        variance = blur_px**2 - (step**2 - 1) / 12 - (step**2 / 6 if step > 1 else 0)
        remaining = max(0.0, variance) ** 0.5 / step
        rows, columns = (-(-side // step) for side in shape)
        around_px = -(-around_markers(marker_mask) // step)
        return cls(step, (rows, columns), remaining, around_px)

    @classmethod
    def at_every_pixel(
        cls, shape: tuple[int, ...], marker_mask: Bool | None, blur_px: float
    ) -> Self:
        """Smooth (rows, columns) images with this standard deviation, at their full resolution."""
        return cls(1, (shape[0], shape[1]), blur_px, around_markers(marker_mask))

    def wider(self) -> Self:
        """Return the sampling to coarse pixels of twice this side, whose mean is their smoothing.

        The rows and columns of this grid must be even.
        """
        rows, columns = (side // 2 for side in self.shape)
        around_px = -(-self.around_px // 2)
        return replace(
            self,
            step=2 * self.step,
            shape=(rows, columns),
            blur=0.0,
            around_px=around_px,
            averaged=True,
        )

    def smooth(self, pixels: NDArray[Any], marker_mask: Bool | None) -> NDArray[Any]:
        """Smooth (H, W, K) intensities to (h, w, K), same dtype, with the markers filled."""
        parts = self._parts(pixels, marker_mask)
        return parts[0] if parts[0].ndim == 3 else np.dstack(parts)

    def smooth_image(self, pixels: NDArray[Any], marker_mask: Bool | None) -> Float32:
        """Like :meth:`smooth`, interpolated to every pixel, (H, W, K) float32."""
        size = pixels.shape[0], pixels.shape[1]
        return np.dstack(
            [
                interpolate_cells(plane.astype(np.float32), self.step, size)
                for plane in self.planes(pixels, marker_mask)
            ]
        )

    def planes(self, pixels: NDArray[Any], marker_mask: Bool | None) -> list[NDArray[Any]]:
        """Like :meth:`smooth`, as K planes of (h, w)."""
        parts = self._parts(pixels, marker_mask)
        return parts if parts[0].ndim == 2 else [np.asarray(p) for p in cv2.split(parts[0])]

    def _parts(self, pixels: NDArray[Any], marker_mask: Bool | None) -> list[NDArray[Any]]:
        """Smooth all channels at once where OpenCV can, else plane by plane."""
        if pixels.flags.c_contiguous and 1 < pixels.shape[2] <= MOST_CHANNELS:
            return self._smooth_parts([pixels], marker_mask)
        return self._smooth_parts(planes_of(pixels), marker_mask)

    def _smooth_parts(
        self, parts: list[NDArray[Any]], marker_mask: Bool | None
    ) -> list[NDArray[Any]]:
        if marker_mask is None or not self.around_px:
            for times in self._factors:
                parts = [_coarse(part, times) for part in parts]
            return [self._smooth(part) for part in parts]
        hidden = marker_mask
        for times in self._factors:
            share, parts = _of_surface(parts, hidden, times)
            hidden = share < 128  # [of 255] half of the pixel is free of markers
        around = AroundMarkers(bare_mask(hidden), self.around_px)
        return [self._smooth(around.fill_part(part)) for part in parts]

    @property
    def _factors(self) -> tuple[int, ...]:
        """Factors by which an image is shrunk, one after the other."""
        return (self.step // 2, 2) if self.averaged else (self.step,)

    def _smooth(self, part: NDArray[Any]) -> NDArray[Any]:
        if self.blur == 0:
            return part.copy()
        side = 2 * max(1, round(2.5 * self.blur)) + 1  # [sigmas] half of the window
        return np.asarray(cv2.GaussianBlur(part, (side, side), self.blur))


def _of_surface(
    parts: list[NDArray[Any]], hidden: Bool, times: int
) -> tuple[NDArray[np.uint8], list[NDArray[Any]]]:
    """Average each coarse pixel over its part that is not hidden, so that none of it is lost.

    Returns the share of this part, and the means.
    """
    surface = bare_mask(hidden)
    share = _coarse(surface, times)
    means = []
    for part in parts:
        bare = np.zeros_like(part)
        cv2.copyTo(part, surface, bare)
        small = _coarse(bare, times)
        shares = share.astype(part.dtype)
        if small.ndim == 3:
            shares = np.asarray(cv2.merge([shares] * small.shape[2]))
        means.append(np.asarray(cv2.divide(small, shares, scale=255)))
    return share, means


def _coarse(part: NDArray[Any], times: int) -> NDArray[Any]:
    """Average over squares of ``times`` pixels, of which the last may reach beyond the image."""
    if times == 1:
        return part
    rows, columns = (-(-side // times) for side in part.shape[:2])
    below, right = rows * times - part.shape[0], columns * times - part.shape[1]
    if below or right:
        part = cv2.copyMakeBorder(part, 0, below, 0, right, cv2.BORDER_REPLICATE)
    return shrink_image(part, (columns, rows))


def two_within(pixels: NDArray[Any], floor: float, ceiling: float) -> NDArray[np.uint8]:
    """Find the pixels with at least two channels between two bounds.

    A slope has two components, so it takes two channels. Images of a single channel need that one.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    floor, ceiling : float
        Exclusive bounds, in the units of ``pixels``.

    Returns
    -------
    (H, W) uint8
        1 where enough channels are within the bounds, else 0.
    """
    rows, columns, channels = pixels.shape
    below = float(np.nextafter(np.float32(ceiling), np.float32(0)))
    outside = np.zeros((rows, columns), pixels.dtype)
    for plane in planes_of(pixels):
        # finding the extremes is faster than thresholding, and they are rarely out of range
        darkest, brightest = cv2.minMaxLoc(plane)[:2]
        if darkest <= floor:
            outside += cv2.threshold(plane, floor, 1, cv2.THRESH_BINARY_INV)[1]
        if brightest >= ceiling:
            outside += cv2.threshold(plane, below, 1, cv2.THRESH_BINARY)[1]
    allowed: Any = channels - min(2, channels)
    valid = np.asarray(cv2.compare(outside, allowed, cv2.CMP_LE), np.uint8)
    valid &= 1
    return valid
