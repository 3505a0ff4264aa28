"""What the light says: the relative change of each channel since the untouched sensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms import kernels
from tactile_core.algorithms.scratch import borrowed
from tactile_core.algorithms.shrinking import shrunk

Float32 = NDArray[np.float32]

DARK_FRACTION = 0.04
"""Intensities below this fraction of full scale are too dark to divide by."""


_LARGEST_SUM = 16
"""Side of the largest square whose bytes add up to less than 65536."""


@dataclass(frozen=True)
class Smoothing:
    """What is done to every image before anything is read from it; references and presses alike.

    Attributes
    ----------
    boxes_px : tuple of two int
        Sides of the two box filters that are applied in turn; 1 for none.
    around_px : int
        Side of the neighbourhood that marks are filled from; 0 for a skin without marks.
    """

    boxes_px: tuple[int, int] = (5, 5)
    around_px: int = 0

    @classmethod
    def of(cls, reference_marks: NDArray[np.bool_] | None, blur_px: float) -> Smoothing:
        """Smoothing with about this standard deviation, and marks as large as the reference's."""
        # A box of side n has the variance (n² − 1) / 12. The second may be the next larger one.
        first = 2 * int((np.sqrt(6 * blur_px**2 + 1) - 1) / 2) + 1
        pairs = [(n, m) for n in (first, first + 2) for m in (n, n + 2)]
        wanted = 12 * blur_px**2 + 2
        nearest = min(pairs, key=lambda pair: abs(pair[0] ** 2 + pair[1] ** 2 - wanted))
        return cls(nearest, around_marks(reference_marks))

    def apply(
        self,
        pixels: NDArray[Any],
        marks: NDArray[np.bool_] | None,
        out: NDArray[Any] | None = None,
    ) -> NDArray[Any]:
        """(H, W, K) intensities, marks filled and the coating's grain smoothed; same dtype.

        ``out`` may hold the result, if its shape and dtype are those of ``pixels``.
        """
        shape = pixels.shape
        if marks is not None and self.around_px:
            pixels = fill_marks(pixels, marks, self.around_px)
        for side in self.boxes_px:
            if side > 1:
                pixels = cv2.blur(pixels, (side, side), dst=out)
        return np.asarray(pixels).reshape(shape)


def fill_marks(pixels: NDArray[Any], marks: NDArray[np.bool_], size_px: int) -> NDArray[Any]:
    """Replace the pixels of marks by the mean of the skin around them.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    marks : (H, W) bool
    size_px : int
        Side of the neighbourhood; larger than a mark.

    Returns
    -------
    (H, W, K), same dtype
    """
    rows, columns, channels = pixels.shape
    skin = cv2.bitwise_not(marks.view(np.uint8) * np.uint8(255))
    # The mean around a mark varies slowly: a coarser image holds it as well.
    step = max(1, size_px // 8)
    coarse = max(1, columns // step), max(1, rows // step)
    box = (max(3, size_px // step) | 1,) * 2
    with borrowed(pixels.shape, pixels.dtype) as without:
        without.fill(0)
        cv2.copyTo(pixels, skin, without)
        small = _shrunk(without, coarse, step)
    total = cv2.blur(small, box).reshape(small.shape)
    count = np.maximum(cv2.blur(_shrunk(skin[..., None], coarse, step)[..., 0], box) / 255, 1e-3)
    # a count per channel: numpy is slow where one number serves so few
    counts = np.repeat(count, channels, axis=1).reshape(total.shape)
    around = np.asarray(total / counts).astype(pixels.dtype)
    filled = np.asarray(cv2.resize(around, (columns, rows), interpolation=cv2.INTER_LINEAR))
    cv2.copyTo(pixels, skin, filled)
    return filled.reshape(pixels.shape)


def _shrunk(pixels: NDArray[Any], size: tuple[int, int], step: int) -> Float32:
    """(h, w, K) means over squares of ``step`` pixels' side, rounded where ``pixels`` are."""
    rows, columns, channels = pixels.shape
    compiled = kernels.ready()
    whole = rows % step == columns % step == 0 and step <= _LARGEST_SUM and step != 2
    if compiled is not None and whole and pixels.dtype == np.uint8:
        small = compiled.means_of_bytes(pixels.reshape(rows, -1), channels, step)
    else:
        small = shrunk(pixels, size, halvings=0)
    return np.asarray(small, np.float32).reshape(size[1], size[0], channels)


def around_marks(marks: NDArray[np.bool_] | None) -> int:
    """Side in px of a neighbourhood that reaches the skin on all sides of most marks; 0 if none."""
    if marks is None or not marks.any():
        return 0
    _, _, boxes, _ = cv2.connectedComponentsWithStats(marks.view(np.uint8))
    sides = np.asarray(boxes)[1:, cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1]
    return int(np.median(sides.max(axis=1))) * 2 + 1


def relative_change(smoothed: NDArray[Any], base: Float32, *, full_scale: float = 255.0) -> Float32:
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
    floor = np.float32(DARK_FRACTION * full_scale)
    return np.asarray(smoothed / np.maximum(base, floor) - np.float32(1), np.float32)


def place(shape: tuple[int, int]) -> Float32:
    """(H, W, 2) position of each pixel: x and y from the centre, in half widths of the image."""
    h, w = shape
    x = (np.arange(w, dtype=np.float32) - (w - 1) / 2) / (w / 2)
    y = (np.arange(h, dtype=np.float32) - (h - 1) / 2) / (w / 2)
    return np.stack(np.broadcast_arrays(x, y[:, None]), -1).astype(np.float32)
