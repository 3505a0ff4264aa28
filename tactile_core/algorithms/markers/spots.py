"""Spots: connected pixels, their moments and their grey values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float64, Intp, UInt8
from tactile_core.algorithms.markers.contrast import DETECTION, FULL, square

UInt16 = NDArray[np.uint16]

_MAX_LABELS = 2**16 - 1  # As many labels as 16 bits hold

# Variance of the position within one pixel, that of a uniform distribution of unit width.
_PIXEL_VARIANCE_PX2 = 1 / 12


@dataclass(frozen=True, eq=False)
class Spots:
    """Moments of N spots, weighted by contrast.

    Attributes
    ----------
    mass : (N,) float64
        Integrated contrast: the sum of the weights.
    centres : (N, 2) float64
        Centroids, x and y, px.
    slant : (N, 2) float64
        Difference of the variances along x and y, and twice the covariance, px²: a vector at twice
        the angle of the major axis from x towards y.
    sigma_px : (N, 2) float64
        Standard deviation along the major and the minor axis, px.
    peak : (N,) uint8
        Maximum contrast in the spot and its neighbourhood.
    truncated : (N, 4) bool
        Whether the spot touches the left, top, right or bottom border of the image.
    """

    mass: Float64
    centres: Float64
    slant: Float64
    sigma_px: Float64
    peak: UInt8
    truncated: Bool

    def __len__(self) -> int:
        return len(self.mass)

    @property
    def major_axes(self) -> Float64:
        """(N, 2) unit vectors of the major axes."""
        angle = np.arctan2(self.slant[:, 1], self.slant[:, 0]) / 2
        return np.stack([np.cos(angle), np.sin(angle)], 1)

    def subset(self, which: Bool | NDArray[np.intp]) -> Spots:
        """Return the spots that a mask or indices select."""
        return Spots(
            self.mass[which],
            self.centres[which],
            self.slant[which],
            self.sigma_px[which],
            self.peak[which],
            self.truncated[which],
        )


def measured_spots(dark: UInt8, weight: UInt8, peaks: UInt8, *, faintest: float, rim: int) -> Spots:
    """Measure each connected spot, including a rim that contains its blurred edge.

    Parameters
    ----------
    dark : (h, w) uint8
        Not 0 on spots.
    weight : (h, w) uint8
        Contrast that is counted, on spots and on their rims.
    peaks : (h, w) uint8
        Maximum contrast in the neighbourhood of each pixel.
    faintest : float
        Spots with a lower peak are left out.
    rim : int
        Width of the rim, px.

    Returns
    -------
    Spots
    """
    moments, truncated = _moments(dark, weight, rim)
    mass = np.maximum(moments[0], 1e-9)
    means = moments[1:] / mass
    x, y = centres = means[:2]
    column, row = np.rint(centres).astype(np.intp)
    peak = peaks[row, column]
    kept = peak > faintest
    if not kept.all():
        mass, peak, truncated = mass[kept], peak[kept], truncated[kept]
        x, y = centres = centres[:, kept]
        means = means[:, kept]
    xx, xy, yy = means[2:] - (x * x, x * y, y * y)
    slant = np.array([xx - yy, 2 * xy])
    mean, half_difference = (xx + yy) / 2 + _PIXEL_VARIANCE_PX2, np.hypot(*slant) / 2
    variances = mean + half_difference, np.maximum(mean - half_difference, _PIXEL_VARIANCE_PX2)
    return Spots(mass, centres.T, slant.T, np.sqrt(variances).T, peak, truncated)


def _moments(dark: UInt8, weight: UInt8, rim: int) -> tuple[Float64, Bool]:
    """Sums (6, N) of w, wx, wy, wxx, wxy and wyy of each spot, and which borders (N, 4) it touches.

    Where rims overlap, a pixel belongs to the last spot.
    """
    count, labels = cv2.connectedComponentsWithAlgorithm(dark, 8, cv2.CV_16U, cv2.CCL_SPAGHETTI)
    count = min(count, _MAX_LABELS)
    if count == 1:  # the background
        return np.zeros((6, 0)), np.zeros((0, 4), np.bool_)
    truncated = np.zeros((count, 4), np.bool_)
    for side, border in enumerate((labels[:, 0], labels[0], labels[:, -1], labels[-1])):
        truncated[border, side] = True
    wide = np.asarray(cv2.dilate(labels, square(rim)), np.uint16)
    of, y, x, (w, first, second) = _run_sums(wide, weight)
    wx = first + w * x
    sums = w, wx, w * y, second + x * (first + wx), wx * y, w * y * y
    moments = np.array([np.bincount(of, each, count)[:count] for each in sums])
    return moments[:, 1:], truncated[1:]


def _run_sums(labels: UInt16, weight: UInt8) -> tuple[Intp, Float64, Float64, Float64]:
    """Label, row and first column (R,) of each run of equal labels, and its sums (3, R).

    The sums are those of w, wj and wj², with j the distance from the first column. There are far
    fewer runs than pixels; padded to equal lengths, they are summed by one matrix product.
    """
    # with a column in front and a row below, no run reaches from one row to the next
    flat, weights = (
        np.asarray(cv2.copyMakeBorder(image, 0, 1, 1, 0, cv2.BORDER_CONSTANT)).ravel()
        for image in (labels, weight)
    )
    (edges,) = (flat[1:] != flat[:-1]).nonzero()
    edges += 1
    of = flat[edges].astype(np.intp)
    (runs,) = of.nonzero()
    starts = edges[runs]
    lengths = edges[runs + 1] - starts
    longest = int(lengths.max())
    windows = np.ndarray((len(weights) - longest, longest), np.uint8, weights, 0, (1, 1))
    inside, powers = _of_lengths(longest)
    sums = (windows[starts] & inside.take(lengths, axis=0)).astype(np.float32) @ powers
    columns = labels.shape[1] + 1
    y = starts // columns
    x = starts - columns * y - 1
    return of[runs], y.astype(np.float64), x.astype(np.float64), sums.T.astype(np.float64)


@lru_cache(maxsize=4)
def _of_lengths(longest: int) -> tuple[UInt8, NDArray[np.float32]]:
    """All bits of the pixels of runs of each length, (N + 1, N), and 1, j and j², (N, 3)."""
    j = np.arange(longest)
    inside = np.where(j < np.arange(longest + 1)[:, None], np.uint8(255), np.uint8(0))
    return inside, np.stack([np.ones(longest), j, j * j], axis=1).astype(np.float32)


_SQUARES = np.arange(FULL + 1) ** 2


class SpotPixels(NamedTuple):
    """Pixels of the dark spots of a frame.

    Attributes
    ----------
    dark : (h, w) uint8
        Not 0 on spots.
    weight : (h, w) uint8
        Contrast that is counted, on spots and on their rims.
    peaks : (h, w) uint8
        Maximum contrast in the neighbourhood of each pixel.
    level : float
        Peak contrast of a typical marker.
    """

    dark: UInt8
    weight: UInt8
    peaks: UInt8
    level: float


def spot_pixels(contrast: UInt8, size_px: float, *, darkest: float) -> SpotPixels:
    """Find the pixels of the dark spots of a frame.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`tactile_core.algorithms.markers.contrast_of`.
    size_px : float
        Diameter of a marker, in pixels of the contrast.
    darkest : float
        Lower bound of the typical contrast.

    Returns
    -------
    SpotPixels
    """
    smoothing = int(DETECTION.smoothing_diameters * size_px)
    opening, reach = (
        int(diameters * size_px / 2)
        for diameters in (DETECTION.opening_diameters, DETECTION.peak_diameters)
    )
    smooth = _smooth_contrast(contrast, smoothing)
    thick = np.asarray(cv2.morphologyEx(smooth, cv2.MORPH_OPEN, square(opening)), np.uint8)
    peaks = np.asarray(cv2.dilate(thick, square(reach)), np.uint8)
    level = max(_typical_contrast(peaks), darkest)
    local_threshold = cv2.convertScaleAbs(peaks, alpha=DETECTION.marker_share)
    above_local = cv2.compare(thick, local_threshold, cv2.CMP_GT)
    _, above_global = cv2.threshold(thick, DETECTION.min_contrast * level, FULL, cv2.THRESH_BINARY)
    background = cv2.convertScaleAbs(peaks, alpha=DETECTION.background_share)
    dark = np.asarray(cv2.bitwise_and(above_local, above_global), np.uint8)
    weight = np.asarray(cv2.subtract(smooth, background), np.uint8)
    return SpotPixels(dark, weight, peaks, level)


def _smooth_contrast(contrast: UInt8, reach: int) -> UInt8:
    return np.asarray(cv2.GaussianBlur(contrast, (2 * reach + 1,) * 2, 0), np.uint8)


def _typical_contrast(peaks: UInt8) -> float:
    """Peak contrast of a typical marker.

    Much of the image is near a marker and has its peak. Pixels are weighted by the square of their
    peak, so that grain between markers that are far apart does not count.
    """
    step = DETECTION.sample_step_px
    counts = np.bincount(peaks[::step, ::step].ravel(), minlength=FULL + 1)
    weight = np.cumsum(counts * _SQUARES)
    return float(weight.searchsorted(weight[-1] / 2))
