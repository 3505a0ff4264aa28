"""Dark spots: how much ink each holds, where its centre is and how far it spreads."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms import kernels
from tactile_core.algorithms.markers.darkness import UInt8

Bool = NDArray[np.bool_]
Float64 = NDArray[np.float64]
UInt16 = NDArray[np.uint16]

_RIM = np.ones((5, 5), np.uint8)
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
    axes : (N, 2) float64
        Unit vector along which each is longest.
    spread : (N, 2) float64
        Standard deviation along that axis and across, px.
    peak : (N,) uint8
        How dark it or its nearest surroundings are at most.
    cut : (N, 4) bool
        It touches the image's left, top, right or lower border.
    """

    ink: Float64
    centres: Float64
    axes: Float64
    spread: Float64
    peak: UInt8
    cut: Bool

    def __len__(self) -> int:
        return len(self.ink)

    def chosen(self, which: Bool) -> Spots:
        """Return some of them."""
        return Spots(
            self.ink[which],
            self.centres[which],
            self.axes[which],
            self.spread[which],
            self.peak[which],
            self.cut[which],
        )


def measured_spots(dark: UInt8, weight: UInt8, peaks: UInt8) -> Spots:
    """Measure each connected spot with a rim of two pixels, which holds the blurred outline.

    Parameters
    ----------
    dark : (h, w) uint8
        Not 0 on spots.
    weight : (h, w) uint8
        What counts as ink, on spots and on their rims.
    peaks : (h, w) uint8
        The most of the darkness around each pixel.
    """
    count, labels = cv2.connectedComponentsWithAlgorithm(
        dark, 8, cv2.CV_16U, cv2.CCL_SPAGHETTI
    )
    count = min(count, _MOST)
    wide = np.asarray(cv2.dilate(labels, _RIM), np.uint16)
    moments = _moments(wide, weight, count)
    cut = np.zeros((count, 4), np.bool_)
    for side, border in enumerate((labels[:, 0], labels[0], labels[:, -1], labels[-1])):
        cut[border, side] = True
    whole = moments[0] > 0
    whole[0] = False  # what is not dark
    moments, cut = moments[:, whole], cut[whole]
    ink, x, y = moments[0], moments[1] / moments[0], moments[2] / moments[0]
    xx = moments[3] / ink - x * x + _LEAST_VARIANCE_PX2
    xy = moments[4] / ink - x * y
    yy = moments[5] / ink - y * y + _LEAST_VARIANCE_PX2
    mean, unlike = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    turn = np.arctan2(2 * xy, xx - yy) / 2
    return Spots(
        ink,
        np.stack([x, y], 1),
        np.stack([np.cos(turn), np.sin(turn)], 1),
        np.sqrt(np.stack([mean + unlike, np.maximum(mean - unlike, _LEAST_VARIANCE_PX2)], 1)),
        np.asarray(peaks[np.rint(y).astype(int), np.rint(x).astype(int)], np.uint8),
        cut,
    )


def _moments(labels: UInt16, weight: UInt8, count: int) -> Float64:
    """(6, count) sums of w, wx, wy, wxx, wxy and wyy of each label."""
    compiled = kernels.ready()
    if compiled is not None:
        return np.asarray(compiled.moments_of_labels(labels, weight, count))
    inked = cv2.findNonZero(cv2.bitwise_and(weight, weight, mask=cv2.compare(labels, 0, cv2.CMP_GT)))
    if inked is None:
        return np.zeros((6, count))
    columns, rows = inked.reshape(-1, 2).T
    of = labels[rows, columns].astype(np.intp)
    w = weight[rows, columns].astype(np.float64)
    x, y = columns.astype(np.float64), rows.astype(np.float64)
    wx, wy = w * x, w * y
    sums = (w, wx, wy, wx * x, wx * y, wy * y)
    return np.stack([np.bincount(of, weights=s, minlength=count)[:count] for s in sums])
