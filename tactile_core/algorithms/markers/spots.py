"""Dark spots: how much ink each holds, where its centre is and how far it spreads."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.types import Bool, Float64, UInt8

UInt16 = NDArray[np.uint16]

_MOST = 2**16 - 1
_LEAST_VARIANCE_PX2 = 1 / 12


@dataclass(frozen=True, eq=False)
class Spots:
    """Moments of N spots, weighted by darkness.

    Attributes
    ----------
    ink : (N,) float64
        Sum of the weights.
    centres : (N, 2) float64
        x and y, px.
    turn : (N,) float64
        Direction along which each is longest, rad from x towards y.
    spread : (N, 2) float64
        Standard deviation along that axis and across, px.
    peak : (N,) uint8
        How dark it or its nearest surroundings are at most.
    cut : (N, 4) bool
        It touches the image's left, top, right or lower border.
    """

    ink: Float64
    centres: Float64
    turn: Float64
    spread: Float64
    peak: UInt8
    cut: Bool

    def __len__(self) -> int:
        return len(self.ink)

    @property
    def axes(self) -> Float64:
        """(N, 2) unit vectors along which each is longest."""
        return np.stack([np.cos(self.turn), np.sin(self.turn)], 1)

    def chosen(self, which: Bool | NDArray[np.intp]) -> Spots:
        """Return some of them."""
        return Spots(
            self.ink[which],
            self.centres[which],
            self.turn[which],
            self.spread[which],
            self.peak[which],
            self.cut[which],
        )


def measured_spots(
    dark: UInt8, weight: UInt8, peaks: UInt8, *, faintest: float, rim: int, compiled: bool = False
) -> Spots:
    """Measure each connected spot with a rim, which holds the blurred outline.

    Parameters
    ----------
    dark : (h, w) uint8
        Not 0 on spots.
    weight : (h, w) uint8
        What counts as ink, on spots and on their rims.
    peaks : (h, w) uint8
        The most of the darkness around each pixel.
    faintest : float
        Spots that are less dark anywhere are left out.
    rim : int
        Its width, px.
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.
    """
    count, labels = cv2.connectedComponentsWithAlgorithm(dark, 8, cv2.CV_16U, cv2.CCL_SPAGHETTI)
    count = min(count, _MOST)
    wide = np.asarray(cv2.dilate(labels, np.ones((2 * rim + 1,) * 2, np.uint8)), np.uint16)
    moments = _moments(wide, weight, count, compiled)
    cut = np.zeros((count, 4), np.bool_)
    for side, border in enumerate((labels[:, 0], labels[0], labels[:, -1], labels[-1])):
        cut[border, side] = True
    ink = np.maximum(moments[0], 1e-9)
    x, y, xx, xy, yy = moments[1:] / ink
    peak = peaks[np.rint(y).astype(np.intp), np.rint(x).astype(np.intp)]
    kept = peak > faintest
    kept[0] = False  # what is not dark
    ink, x, y, xx, xy, yy = (v[kept] for v in (ink, x, y, xx, xy, yy))
    xx, xy, yy = xx - x * x + _LEAST_VARIANCE_PX2, xy - x * y, yy - y * y + _LEAST_VARIANCE_PX2
    mean, unlike = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return Spots(
        ink,
        np.stack([x, y], 1),
        np.arctan2(2 * xy, xx - yy) / 2,
        np.sqrt(np.stack([mean + unlike, np.maximum(mean - unlike, _LEAST_VARIANCE_PX2)], 1)),
        peak[kept],
        cut[kept],
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
