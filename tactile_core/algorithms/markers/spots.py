"""Moments of dark spots: integrated contrast, centroid, orientation and size."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.types import Bool, Float64, UInt8

UInt16 = NDArray[np.uint16]

_MAX_LABELS = 2**16 - 1
"""As many labels as 16 bits hold."""

_PIXEL_VARIANCE_PX2 = 1 / 12
"""Variance of the position within one pixel, that of a uniform distribution of unit width."""


@dataclass(frozen=True, eq=False)
class Spots:
    """Moments of N spots, weighted by contrast.

    Attributes
    ----------
    mass : (N,) float64
        Integrated contrast: the sum of the weights.
    centres : (N, 2) float64
        Centroids, x and y, px.
    orientation : (N,) float64
        Direction of the major axis, rad from x towards y.
    sigma_px : (N, 2) float64
        Standard deviation along the major and the minor axis, px.
    peak : (N,) uint8
        Maximum contrast in the spot and its neighbourhood.
    truncated : (N, 4) bool
        Whether the spot touches the left, top, right or bottom border of the image.
    """

    mass: Float64
    centres: Float64
    orientation: Float64
    sigma_px: Float64
    peak: UInt8
    truncated: Bool

    def __len__(self) -> int:
        return len(self.mass)

    @property
    def major_axes(self) -> Float64:
        """(N, 2) unit vectors of the major axes."""
        return np.stack([np.cos(self.orientation), np.sin(self.orientation)], 1)

    def subset(self, which: Bool | NDArray[np.intp]) -> Spots:
        """Return the spots that a mask or indices select."""
        return Spots(
            self.mass[which],
            self.centres[which],
            self.orientation[which],
            self.sigma_px[which],
            self.peak[which],
            self.truncated[which],
        )


def measured_spots(
    dark: UInt8, weight: UInt8, peaks: UInt8, *, faintest: float, rim: int, compiled: bool = False
) -> Spots:
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
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.

    Returns
    -------
    Spots
    """
    count, labels = cv2.connectedComponentsWithAlgorithm(dark, 8, cv2.CV_16U, cv2.CCL_SPAGHETTI)
    count = min(count, _MAX_LABELS)
    wide = np.asarray(cv2.dilate(labels, np.ones((2 * rim + 1,) * 2, np.uint8)), np.uint16)
    moments = _moments(wide, weight, count, compiled)
    truncated = np.zeros((count, 4), np.bool_)
    for side, border in enumerate((labels[:, 0], labels[0], labels[:, -1], labels[-1])):
        truncated[border, side] = True
    mass = np.maximum(moments[0], 1e-9)
    x, y, xx, xy, yy = moments[1:] / mass
    peak = peaks[np.rint(y).astype(np.intp), np.rint(x).astype(np.intp)]
    kept = peak > faintest
    kept[0] = False  # label 0 is the background
    mass, x, y, xx, xy, yy = (v[kept] for v in (mass, x, y, xx, xy, yy))
    xx, xy, yy = xx - x * x + _PIXEL_VARIANCE_PX2, xy - x * y, yy - y * y + _PIXEL_VARIANCE_PX2
    mean, half_difference = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    major, minor = mean + half_difference, np.maximum(mean - half_difference, _PIXEL_VARIANCE_PX2)
    return Spots(
        mass,
        np.stack([x, y], 1),
        np.arctan2(2 * xy, xx - yy) / 2,
        np.sqrt(np.stack([major, minor], 1)),
        peak[kept],
        truncated[kept],
    )


def _moments(labels: UInt16, weight: UInt8, count: int, compiled: bool) -> Float64:
    """(6, count) sums of w, wx, wy, wxx, wxy and wyy of each label."""
    loops = kernels.chosen(compiled)
    if loops is not None:
        return np.asarray(loops.moments_of_labels(labels, weight, count))
    y, x = np.nonzero(labels)
    of, w = labels[y, x].astype(np.intp), weight[y, x].astype(np.float64)
    wx, wy = w * x, w * y
    sums = (w, wx, wy, wx * x, wx * y, wy * y)
    return np.stack([np.bincount(of, each, count)[:count] for each in sums])
