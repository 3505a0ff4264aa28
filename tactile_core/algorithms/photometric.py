"""What the light says: the relative change of each channel since the untouched sensor."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.scratch import borrowed
from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.levels import LEVELS


_FINEST = 6
"""Pixels that are left of a neighbourhood's side when markers are filled."""

_NO_MARKER: Any = 0  # numbers are compared with as well, which the types do not say


@dataclass(frozen=True)
class Smoothing:
    """What is done to every image before anything is read from it; references and presses alike.

    Attributes
    ----------
    boxes_px : tuple of two int
        Sides of the two box filters that are applied in turn; 1 for none.
    around_px : int
        Side of the neighbourhood that markers are filled from; 0 for a skin without markers.
    """

    boxes_px: tuple[int, int] = (5, 5)
    around_px: int = 0

    @classmethod
    def of(cls, reference_markers: NDArray[np.bool_] | None, blur_px: float) -> Smoothing:
        """Smoothing with about this standard deviation, and markers as large as the reference's."""
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
        """(H, W, K) intensities, markers filled and the coating's grain smoothed; same dtype.

        ``out`` may hold the result, if its shape and dtype are those of ``pixels``.
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
    """Replace the pixels of markers by the mean of the skin around them.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    marker_mask : (H, W) bool
    size_px : int
        Side of the neighbourhood; larger than a marker.

    Returns
    -------
    (H, W, K), same dtype
    """
    around = AroundMarkers(bare_mask(marker_mask), size_px)
    with planes_of(pixels) as planes:
        filled = [around.filled(plane) for plane in planes]
    return np.asarray(cv2.merge(filled)).reshape(pixels.shape)


@contextmanager
def planes_of(pixels: NDArray[Any]) -> Iterator[list[NDArray[Any]]]:
    """Lend the channels of an (H, W, K) image as planes, until the end of the ``with`` block."""
    planar = pixels.transpose(2, 0, 1)
    if planar.flags.c_contiguous:
        yield list(planar)
        return
    with borrowed(planar.shape, planar.dtype) as memory:
        cv2.split(pixels, list(memory))
        yield list(memory)


def bare_mask(marker_mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """(H, W) uint8: 255 where no marker hides the skin, else 0."""
    return np.asarray(cv2.compare(marker_mask.view(np.uint8), _NO_MARKER, cv2.CMP_EQ), np.uint8)


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
        # The mean around a marker varies slowly: a coarser image holds it as well, and halving is
        # by far the fastest way to one.
        step = 1
        while 2 * step * _FINEST <= size_px and rows % (2 * step) == columns % (2 * step) == 0:
            step *= 2
        self._coarse = max(1, columns // step), max(1, rows // step)
        self._box = (max(3, size_px // step) | 1,) * 2
        self._count = np.maximum(self._total(surface) / np.float32(255), np.float32(1e-3))

    def filled(self, part: NDArray[Any]) -> NDArray[Any]:
        """(H, W) or a few channels of (H, W, K) with the markers filled, same dtype."""
        with borrowed(part.shape, part.dtype) as without:
            without.fill(0)
            cv2.copyTo(part, self._surface, without)
            total = self._total(without)
        count = self._count if part.ndim == 2 else cv2.merge([self._count] * part.shape[2])
        around = np.asarray(cv2.divide(total, count))
        if part.dtype.kind == "u":
            around = np.rint(around, out=around).astype(part.dtype)
        filled = cv2.resize(around, part.shape[1::-1], interpolation=cv2.INTER_LINEAR)
        cv2.copyTo(part, self._surface, filled)
        return np.asarray(filled)

    def _total(self, part: NDArray[Any]) -> Float32:
        small = shrunk(part, self._coarse)
        return np.asarray(cv2.boxFilter(small, cv2.CV_32F, self._box), np.float32)


def around_markers(marker_mask: NDArray[np.bool_] | None) -> int:
    """Side in px of a neighbourhood that reaches beyond most markers on all sides; 0 if none."""
    if marker_mask is None or not marker_mask.any():
        return 0
    _, _, boxes, _ = cv2.connectedComponentsWithStats(marker_mask.view(np.uint8))
    sides = np.asarray(boxes)[1:, cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1]
    return int(np.median(sides.max(axis=1))) * 2 + 1


def relative_change(
    smoothed: NDArray[Any], base: Float32, *, full_scale: float = LEVELS.full_scale_8_bit
) -> Float32:
    """(I − I₀) / I₀ of each channel.

    A ratio does not depend on how brightly each lamp lights each place, which the plain difference
    does; on real balls it removes most of the error that position leaves.

    Parameters
    ----------
    smoothed : (..., K)
        Intensities now.
    base : (..., K) float32
        Intensities of the untouched sensor.
    full_scale : float
        The largest intensity.

    Returns
    -------
    (..., K) float32
        0 where nothing changed, −1 where all light is gone.
    """
    floor = np.float32(LEVELS.least_divisor_share * full_scale)
    return np.asarray(smoothed / np.maximum(base, floor) - np.float32(1), np.float32)


def place(shape: tuple[int, int]) -> Float32:
    """(H, W, 2) position of each pixel: x and y from the centre, in half widths of the image."""
    y, x = (from_middle(side) / (shape[1] / 2) for side in shape)
    return np.stack(np.broadcast_arrays(x, y[:, None]), -1).astype(np.float32)
