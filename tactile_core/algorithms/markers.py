"""Printed dots on the skin: which pixels they hide, and how to see past them."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError

Array = NDArray[Any]
Bool = NDArray[np.bool_]
Float32 = NDArray[np.float32]

_CLOSING_DIAMETERS = 2.2
_FLOOR_SHARE = 0.08
_LEAST_DOT_PX = 3.0
_COARSE_DOT_PX = 6.0
_SIZE_STEP = 1.25
_ALIKE = 1.45
_LEAST_DARKNESS = 0.1
_LEAST_DOTS = 12
_LEAST_REGULAR = 0.7


def marker_mask(pixels: Array, *, diameter_px: float, darkness: float = 0.12) -> Bool:
    """Mask dark dots, with a rim of one pixel.

    A pixel shows a dot where the mean of the channels is darker by the share ``darkness`` than
    its surroundings, the closing that bridges what is dark and smaller than 2.2 dots. The mean
    hardly changes with the colour of light or slope, and shading and shadows wider than a dot
    are their own surroundings. Large dots are looked for at reduced resolution.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The image.
    diameter_px : float
        Size of a dot.
    darkness : float
        Share of light that a dot takes away, at least.

    Returns
    -------
    (H, W) bool

    Raises
    ------
    InputError
        The image is not (H, W, K), or the diameter is not positive.
    """
    _check(pixels)
    if not diameter_px > 0:
        raise InputError(f"dots of {diameter_px} px cannot be masked; give a positive diameter")
    shrink = _shrink(diameter_px)
    brightness = _brightness(pixels, shrink)
    closed = _closed(brightness, diameter_px / shrink)
    bound = cv2.addWeighted(closed, 1 - darkness, closed, 0.0, 0.0)
    dark = cv2.compare(brightness, bound, cv2.CMP_LT)
    dark = _enlarged(dark, shrink, pixels.shape[:2])
    return np.asarray(cv2.dilate(dark, np.ones((3, 3), np.uint8)) > 0)


def find_marker_diameter(pixels: Array) -> tuple[float, float] | None:
    """Find whether dots are printed on the skin, how large they are and how far apart.

    Dots of many sizes are tried. Those count that are as large as tried, alike in area, compact,
    and that lie in a lattice: most have their nearest neighbours at much the same distance.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The untouched skin.

    Returns
    -------
    (diameter_px, pitch_px) or None
        None where there are no twelve such dots.
    """
    _check(pixels)
    largest_px = min(pixels.shape[:2]) / 10
    count = max(0, int(np.log(largest_px / _LEAST_DOT_PX) / np.log(_SIZE_STEP)) + 1)
    tried = [_lattice(pixels, _LEAST_DOT_PX * _SIZE_STEP**i) for i in range(count)]
    found = [lattice for lattice in tried if lattice is not None]
    if not found:
        return None
    _, diameter_px, pitch_px = max(found)
    return diameter_px, pitch_px


def _lattice(pixels: Array, diameter_px: float) -> tuple[float, float, float] | None:
    """(score, diameter, pitch) of the dots that are about this large, if they form a lattice."""
    brightness = cv2.GaussianBlur(
        _brightness(pixels, 1).astype(np.float32), (0, 0), 0.3 + 0.08 * diameter_px
    )
    closed = _closed(brightness, diameter_px)
    darkness = (closed - brightness) / closed
    typical = _typical_peak(darkness, diameter_px)
    centres, sizes = _compact_spots(darkness > 0.5 * typical)
    alike = np.abs(np.log(sizes / diameter_px)) < np.log(_ALIKE)
    if typical < _LEAST_DARKNESS or alike.sum() < _LEAST_DOTS:
        return None
    centres, sizes = centres[alike], sizes[alike]
    nearest = _nearest_distance(centres)
    pitch = float(np.median(nearest))
    regular = np.abs(nearest / pitch - 1) < 0.2
    if regular.sum() < max(_LEAST_DOTS, _LEAST_REGULAR * alike.size):
        return None
    size = float(np.median(sizes[regular]))
    if pitch < 1.5 * size:
        return None
    # all the light that the dots take: corners and crumbs of larger dots may be a lattice as well
    return float(regular.sum()) * size**2 * typical, size, pitch


def _typical_peak(darkness: Array, diameter_px: float) -> float:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        (darkness > _LEAST_DARKNESS).view(np.uint8)
    )
    large = np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] > 0.2 * diameter_px**2) + 1
    if not large.size:
        return 0.0
    peaks = np.zeros(count, np.float32)
    np.maximum.at(peaks, np.asarray(labels, np.intp).ravel(), darkness.ravel())
    return float(np.median(peaks[large]))


def _compact_spots(dark: Bool) -> tuple[Array, Array]:
    """Centres (N, 2) and diameters (N,) of the round or square spots that lie within the image."""
    _, _, stats, centres = cv2.connectedComponentsWithStats(dark.view(np.uint8))
    x, y, width, height, area = stats.T
    inside = (x > 0) & (y > 0) & (x + width < dark.shape[1]) & (y + height < dark.shape[0])
    compact = (area > 0.55 * width * height) & (
        np.maximum(width, height) < 2 * np.minimum(width, height)
    )
    keep = inside & compact & (area > 3)
    return centres[keep], np.sqrt(4 * area[keep] / np.pi)


def _nearest_distance(points: Array) -> Array:
    from scipy.spatial import KDTree

    distances, _ = KDTree(points).query(points, k=2)
    return np.asarray(distances)[:, 1]


def _check(pixels: Array) -> None:
    if pixels.ndim not in (2, 3) or 0 in pixels.shape:
        raise InputError(f"an image is (H, W) or (H, W, K); this one is {pixels.shape}")


def _shrink(diameter_px: float) -> int:
    return max(1, min(4, int(diameter_px / _COARSE_DOT_PX)))


def _brightness(pixels: Array, shrink: int) -> Array:
    """(h, w) mean of the channels, shrunk."""
    if shrink > 1:
        size = tuple(max(1, side // shrink) for side in pixels.shape[1::-1])
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    if pixels.ndim == 2:
        return pixels
    if pixels.shape[2] == 3 and pixels.dtype == np.uint8:
        # a third of the time of the general way, and to the same byte
        first, second, third = cv2.split(pixels)
        total = cv2.add(first, second, dtype=cv2.CV_16U)
        total = cv2.add(total, third, dtype=cv2.CV_16U)
        return np.asarray(cv2.convertScaleAbs(total, alpha=1 / 3))
    share = np.full((1, pixels.shape[2]), 1 / pixels.shape[2], np.float32)
    return cv2.transform(pixels, share).reshape(pixels.shape[:2])


def _enlarged(dark: Array, times: int, shape: tuple[int, ...]) -> Array:
    """Repeat each pixel of a shrunk (h, w) uint8 image, up to an (H, W) shape."""
    if (dark.shape[0] * times, dark.shape[1] * times) != shape:
        return np.asarray(cv2.resize(dark, shape[::-1], interpolation=cv2.INTER_NEAREST))
    # much faster than any interpolation: channels that are all alike are pixels side by side
    wide = np.asarray(cv2.merge([dark] * times)).reshape(len(dark), -1)
    return np.repeat(wide, times, axis=0)


def _closed(brightness: Array, diameter_px: float) -> Array:
    """Brightness of the surroundings, bounded from below where it is too dark to compare."""
    side = 2 * round(0.5 * _CLOSING_DIAMETERS * diameter_px) + 1
    closed = cv2.morphologyEx(brightness, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    full = 255.0 if closed.dtype == np.uint8 else float(closed.max())
    return np.maximum(closed, closed.dtype.type(_FLOOR_SHARE * full))
