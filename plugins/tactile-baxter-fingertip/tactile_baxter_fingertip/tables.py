"""Smooth tables over two bytes, from scattered samples."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Bytes = NDArray[np.uint8]

ENTRIES = 256
"""Entries along each axis: a byte is an index."""

_CELLS = 128
_SPREADS_CELLS = (1.3, 2.6, 5.2, 10.4, 20.8)
_ENOUGH_SAMPLES = 3.0
_BORDER = 48


def smooth_table(
    first: Bytes, second: Bytes, values: Float, weights: Float, *, periodic: bool = False
) -> Float32:
    """Weighted mean of scattered values around every entry.

    Each entry is averaged over the narrowest neighbourhood that holds a few samples, so that dense
    parts keep their detail and empty ones take after the nearest samples.

    Parameters
    ----------
    first, second : (N,) uint8
        The entry of each sample.
    values : (N, M) float
    weights : (N,) float
        Non-negative.
    periodic : bool
        Whether the first axis is an angle.

    Returns
    -------
    (256, 256, M) float32
    """
    step = ENTRIES // _CELLS
    cell = (first // step).astype(np.intp) * _CELLS + second // step

    def sums(weight: Float) -> Float:
        counted = np.bincount(cell, weight, _CELLS**2)
        return np.asarray(counted.reshape(_CELLS, _CELLS), np.float64)

    planes = [sums(weights), *(sums(weights * column) for column in values.T)]
    known = np.zeros((_CELLS, _CELLS), bool)
    means = np.zeros((_CELLS, _CELLS, values.shape[1]))
    usual = float(weights.mean())
    for spread in _SPREADS_CELLS:
        total, *spreads = (_blurred(plane, spread, periodic) for plane in planes)
        mean = np.stack(spreads, -1) / np.maximum(total, 1e-12)[..., None]
        means[~known] = mean[~known]
        known |= total * 2 * np.pi * spread**2 > _ENOUGH_SAMPLES * usual
    framed = np.asarray(cv2.copyMakeBorder(means, 1, 1, 1, 1, cv2.BORDER_REPLICATE))
    if periodic:
        framed[0], framed[-1] = framed[-2], framed[1]
    size = ENTRIES + 2 * step
    finer = cv2.resize(framed, (size, size), interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(
        finer[step:-step, step:-step].reshape(ENTRIES, ENTRIES, -1), np.float32
    )


def _blurred(plane: Float, spread: float, periodic: bool) -> Float:
    """Gaussian sums, with nothing beyond the border, or with the first axis wrapped around."""
    rows = cv2.BORDER_WRAP if periodic else cv2.BORDER_CONSTANT
    wide = cv2.copyMakeBorder(plane, _BORDER, _BORDER, 0, 0, rows)
    wide = cv2.copyMakeBorder(wide, 0, 0, _BORDER, _BORDER, cv2.BORDER_CONSTANT)
    blurred = cv2.GaussianBlur(wide, (0, 0), spread)
    return np.asarray(blurred[_BORDER:-_BORDER, _BORDER:-_BORDER], np.float64)
