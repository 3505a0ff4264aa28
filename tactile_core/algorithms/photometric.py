"""Relative change of each light channel against the reference image."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.levels import LEVELS


class MARKER_FILL:
    """Parameters of filling markers from the gel surface around them.

    Nothing sets them from outside: the size of the markers sets the size of the neighbourhood.
    """

    # [count] The image is halved while a neighbourhood is still at least this many cells wide.
    fewest_cells = 6
    diameters = 2  # [marker diameters] Side of the neighbourhood, to which one pixel is added
    # [px] Lower bound of the area that a mean is taken over, against division by zero.
    least_surface_px = 1e-3


@dataclass(frozen=True)
class Smoothing:
    """Preprocessing that references and presses share: markers filled, noise smoothed.

    Attributes
    ----------
    boxes_px : tuple of two int
        Sides of the two box filters, applied one after the other; 1 for none.
    around_px : int
        Side of the neighbourhood that markers are filled from; 0 for a gel without markers.
    """

    boxes_px: tuple[int, int] = (5, 5)
    around_px: int = 0

    @classmethod
    def of(cls, reference_markers: NDArray[np.bool_] | None, blur_px: float) -> Smoothing:
        """Choose box filters of about this standard deviation, and a neighbourhood for markers."""
        # A box of side n has the variance (n² − 1) / 12. The second may be the next larger one.
        first = 2 * int((np.sqrt(6 * blur_px**2 + 1) - 1) / 2) + 1
        pairs = [(n, m) for n in (first, first + 2) for m in (n, n + 2)]
        wanted = 12 * blur_px**2 + 2
        nearest = min(pairs, key=lambda pair: abs(pair[0] ** 2 + pair[1] ** 2 - wanted))
        return cls(nearest, around_markers(reference_markers))

    def apply(
        self,
        pixels: NDArray[Any],
        marker_mask: NDArray[np.bool_] | None,
        out: NDArray[Any] | None = None,
    ) -> NDArray[Any]:
        """Fill the markers and smooth the noise of the coating.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marker_mask : (H, W) bool or None
        out : (H, W, K), same dtype, optional
            Memory for the result.

        Returns
        -------
        (H, W, K), same dtype
        """
        shape = pixels.shape
        if marker_mask is not None and self.around_px:
            pixels = fill_markers(pixels, marker_mask, self.around_px)
        for side in self.boxes_px:
            if side > 1:
                pixels = cv2.blur(pixels, (side, side), dst=out)
        return np.asarray(pixels).reshape(shape)


def fill_markers(
    pixels: NDArray[Any], marker_mask: NDArray[np.bool_], size_px: int
) -> NDArray[Any]:
    """Replace the pixels of markers by the mean of the gel surface around them.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    marker_mask : (H, W) bool
    size_px : int
        Side of the neighbourhood, larger than a marker.

    Returns
    -------
    (H, W, K), same dtype
    """
    around = AroundMarkers(bare_mask(marker_mask), size_px)
    filled = [around.filled(plane) for plane in planes_of(pixels)]
    return np.asarray(cv2.merge(filled)).reshape(pixels.shape)


def planes_of(pixels: NDArray[Any]) -> list[NDArray[Any]]:
    """Return the channels of an (H, W, K) image as contiguous planes, views where they are."""
    planar = pixels.transpose(2, 0, 1)
    return list(planar if planar.flags.c_contiguous else np.ascontiguousarray(planar))


def bare_mask(marker_mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return (H, W) uint8: 255 where no marker hides the gel surface, else 0."""
    # less than half the time of a comparison: 0 − 1 is 255
    return np.subtract(marker_mask.view(np.uint8), np.uint8(1))


class AroundMarkers:
    """Fills the markers of one frame, up to four channels at a time.

    Parameters
    ----------
    surface : (H, W) uint8
        From :func:`bare_mask`.
    size_px : int
        Side of the neighbourhood that markers are filled from.
    """

    def __init__(self, surface: NDArray[np.uint8], size_px: int) -> None:
        self._surface = surface
        rows, columns = surface.shape
        # The mean around a marker varies slowly, so a coarser image suffices. Halving is by far
        # the fastest way to make one.
        step = 1
        while (
            2 * step * MARKER_FILL.fewest_cells <= size_px
            and rows % (2 * step) == columns % (2 * step) == 0
        ):
            step *= 2
        self._coarse = max(1, columns // step), max(1, rows // step)
        self._side = max(3, size_px // step) | 1

    @cached_property
    def _count(self) -> Float32:
        """Number of bare pixels in the neighbourhood of each."""
        counts = np.asarray(self._total(self._surface), np.float32)
        counts /= np.float32(255)
        return np.maximum(counts, np.float32(MARKER_FILL.least_surface_px), out=counts)

    def filled(self, part: NDArray[Any]) -> NDArray[Any]:
        """Return (H, W), or up to four channels (H, W, K), with the markers filled; same dtype."""
        without = np.zeros_like(part)
        cv2.copyTo(part, self._surface, without)
        total = self._total(without)
        count = self._count if part.ndim == 2 else cv2.merge([self._count] * part.shape[2])
        around = cv2.divide(total, count, dtype=cv2.CV_8U if part.dtype == np.uint8 else -1)
        if part.dtype == np.uint16:
            around = np.rint(around).astype(np.uint16)
        filled = cv2.resize(around, part.shape[1::-1], interpolation=cv2.INTER_LINEAR)
        cv2.copyTo(part, self._surface, filled)
        return np.asarray(filled)

    def _total(self, part: NDArray[Any]) -> Float32:
        small = shrunk(part, self._coarse)
        size = self._side, self._side
        # sums of bytes are exact, and means are not
        return np.asarray(cv2.boxFilter(small, cv2.CV_32F, size, normalize=False), np.float32)


def around_markers(marker_mask: NDArray[np.bool_] | None) -> int:
    """Side in px of a neighbourhood that extends beyond most markers; 0 without markers."""
    if marker_mask is None or not marker_mask.any():
        return 0
    _, _, boxes, _ = cv2.connectedComponentsWithStats(marker_mask.view(np.uint8))
    sides = np.asarray(boxes)[1:, cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1]
    return int(np.median(sides.max(axis=1))) * MARKER_FILL.diameters + 1


def relative_change(
    smoothed: NDArray[Any], base: Float32, *, full_scale: float = LEVELS.full_scale_8_bit
) -> Float32:
    """Relative change (I − I₀) / I₀ of each channel.

    Unlike the plain difference I − I₀, the ratio does not depend on how brightly each light
    illuminates each place. On recorded balls it removes most of the error that depends on the
    position in the image.

    Parameters
    ----------
    smoothed : (..., K)
        Intensities I of the frame.
    base : (..., K) float32
        Intensities I₀ of the reference.
    full_scale : float
        The intensity at which a channel saturates.

    Returns
    -------
    (..., K) float32
        0 where nothing changed, −1 where no light is left.
    """
    floor = np.float32(LEVELS.least_divisor_share * full_scale)
    return np.asarray(smoothed / np.maximum(base, floor) - np.float32(1), np.float32)


def place(shape: tuple[int, int]) -> Float32:
    """Position of each pixel, (H, W, 2): x and y from the centre, in half widths of the image."""
    y, x = (from_middle(side) / (shape[1] / 2) for side in shape)
    return np.stack(np.broadcast_arrays(x, y[:, None]), -1).astype(np.float32)
