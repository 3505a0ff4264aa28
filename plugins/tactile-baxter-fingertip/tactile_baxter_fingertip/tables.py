"""Smooth lookup tables over two bytes, from scattered samples."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Bytes = NDArray[np.uint8]

ENTRIES = 256  # Entries along each axis: a byte is an index


_CELLS = 128  # [count] Cells along each axis in which samples are counted; each covers two entries
# [cells] Standard deviations of the averaging kernel, from narrow to wide: each twice the one
# before
_SPREADS_CELLS: tuple[float, ...] = (1.3, 2.6, 5.2, 10.4, 20.8)
# [samples of mean weight] An entry takes the narrowest kernel that covers more samples than this
_ENOUGH_SAMPLES = 3.0
# [cells] Padding of the tables before filtering: a little over two standard deviations of the
# widest kernel
_BORDER_CELLS = 48


def smooth_table(
    first: Bytes, second: Bytes, values: Float, weights: Float, *, periodic: bool = False
) -> Float32:
    """Average scattered values around every entry of a table.

    Each entry is a Gaussian average over the narrowest neighbourhood that holds a few samples.
    Dense parts of the table keep their detail; empty parts are filled from the nearest samples.

    Parameters
    ----------
    first, second : (N,) uint8
        Row and column of each sample.
    values : (N, M) float
    weights : (N,) float
        Non-negative.
    periodic : bool
        True if the first axis is an angle.

    Returns
    -------
    (256, 256, M) float32
    """
    cells = _CELLS
    step = ENTRIES // cells
    cell = (first // step).astype(np.intp) * cells + second // step

    def sums(weight: Float) -> Float:
        counted = np.bincount(cell, weight, cells**2)
        return np.asarray(counted.reshape(cells, cells), np.float64)

    planes = [sums(weights), *(sums(weights * column) for column in values.T)]
    filled = np.zeros((cells, cells), bool)
    means = np.zeros((cells, cells, values.shape[1]))
    mean_weight = float(weights.mean())
    for spread in _SPREADS_CELLS:
        total, *blurred = (_blur_plane(plane, spread, periodic) for plane in planes)
        mean = np.stack(blurred, -1) / np.maximum(total, 1e-12)[..., None]
        means[~filled] = mean[~filled]
        filled |= total * 2 * np.pi * spread**2 > _ENOUGH_SAMPLES * mean_weight
    framed = np.asarray(cv2.copyMakeBorder(means, 1, 1, 1, 1, cv2.BORDER_REPLICATE))
    if periodic:
        framed[0], framed[-1] = framed[-2], framed[1]
    size = ENTRIES + 2 * step
    finer = cv2.resize(framed, (size, size), interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(
        finer[step:-step, step:-step].reshape(ENTRIES, ENTRIES, -1), np.float32
    )


def _blur_plane(plane: Float, spread: float, periodic: bool) -> Float:
    """Return Gaussian averages; zeros beyond the border, or the first axis wrapped around."""
    border = _BORDER_CELLS
    rows = cv2.BORDER_WRAP if periodic else cv2.BORDER_CONSTANT
    wide = cv2.copyMakeBorder(plane, border, border, 0, 0, rows)
    wide = cv2.copyMakeBorder(wide, 0, 0, border, border, cv2.BORDER_CONSTANT)
    blurred = cv2.GaussianBlur(wide, (0, 0), spread)
    return np.asarray(blurred[border:-border, border:-border], np.float64)
