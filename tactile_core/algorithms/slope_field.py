"""From one observation to slopes: a model of change and place, over a whole image.

Evaluating a network or a polynomial at every pixel costs tens of milliseconds. Its dependence on
place is smooth, so on large three-channel images it is evaluated on a coarse grid, and a table of
the same model over colour alone gives the detail between: slopes = table + (model − averaged table)
on the coarse grid. Small images and other channel counts take the model everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.colour_table import ColourTable, to_gradient
from tactile_core.algorithms.photometric import (
    DARK_FRACTION,
    around_marks,
    fill_marks,
    place,
    relative_change,
    smooth,
)

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
Model = Callable[[Float32], Float32]

EXACT_PIXELS = 20_000
"""Images up to this size take the model at every pixel."""

COARSE_PIXELS = 3_000
"""About so many points has the coarse grid."""


class SlopeField:
    """A model prepared for one reference.

    Parameters
    ----------
    model : callable
        (N, K + 2) relative changes and place → (N, 2) sines of the slope.
    table : ColourTable or None
        The same model over the change alone; None to take the model everywhere.
    reference : (H, W, K) float32
        The untouched sensor.
    reference_marks : (H, W) bool or None
    full_scale : float
    """

    def __init__(
        self,
        model: Model,
        table: ColourTable | None,
        reference: Float32,
        reference_marks: Bool | None = None,
        full_scale: float = 255.0,
    ) -> None:
        self._model = model
        self._full_scale = full_scale
        self._around_px = around_marks(reference_marks)
        base = prepared(reference, reference_marks, self._around_px)
        h, w = base.shape[:2]
        self._table = table if base.shape[2] == 3 and h * w > EXACT_PIXELS else None
        if self._table is None:
            self._base = base
            self._place = place((h, w)).reshape(-1, 2)
            return
        self._coarse = coarse_size(h, w)
        coarse_base = cv2.resize(base, self._coarse, interpolation=cv2.INTER_AREA)
        self._base = np.asarray(coarse_base, np.float32)
        coarse_place = cv2.resize(place((h, w)), self._coarse, interpolation=cv2.INTER_AREA)
        self._place = np.asarray(coarse_place, np.float32).reshape(-1, 2)
        self._fine_base = np.maximum(base, np.float32(DARK_FRACTION * full_scale))
        self._base_u8 = np.rint(self._fine_base).clip(1, 255).astype(np.uint8)
        self._flat = self._table.flat()
        self._index = np.zeros((h, w, 4), np.uint8)
        self._detail = np.empty((h, w), np.complex64)

    def measure(self, pixels: NDArray[Any], marks: Bool | None = None) -> tuple[Float32, Float32]:
        """Slopes ∂z/∂x and ∂z/∂y, two (H, W) float32 planes.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marks : (H, W) bool, optional
            Pixels that show a marker; their slope is that of the skin around them.
        """
        smoothed = prepared(pixels, marks, self._around_px)
        h, w = smoothed.shape[:2]
        if self._table is None:
            both = self._from_model(self._change(smoothed)).reshape(h, w, 2)
            return np.ascontiguousarray(both[..., 0]), np.ascontiguousarray(both[..., 1])
        detail = self._from_table(self._table, smoothed)
        coarse = cv2.resize(smoothed, self._coarse, interpolation=cv2.INTER_AREA)
        wanted = self._from_model(self._change(coarse)).reshape(*coarse.shape[:2], 2)
        wanted -= cv2.resize(detail, self._coarse, interpolation=cv2.INTER_AREA)
        detail += cv2.resize(wanted, (w, h), interpolation=cv2.INTER_LINEAR)
        gx, gy = cv2.split(detail)
        return np.asarray(gx, np.float32), np.asarray(gy, np.float32)

    def _change(self, smoothed: NDArray[Any]) -> Float32:
        change = relative_change(smoothed, self._base, full_scale=self._full_scale)
        return change.reshape(-1, change.shape[-1])

    def _from_model(self, change: Float32) -> Float32:
        return to_gradient(self._model(np.concatenate([change, self._place], 1)))

    def _from_table(self, table: ColourTable, smoothed: NDArray[Any]) -> Float32:
        if smoothed.dtype == np.uint8:
            ratio = cv2.divide(smoothed, self._base_u8, scale=table.axis.per_unit)
            # On one channel the subtraction takes a scalar, and saturates at the first entry.
            rows = np.asarray(ratio).reshape(len(ratio), -1)
            rows = np.asarray(cv2.subtract(rows, np.array([table.axis.first], float)))
            bins = np.asarray(cv2.min(rows, np.array([table.axis.last], float)))
            bins = bins.reshape(smoothed.shape)
        else:
            bins = table.bins(smoothed / self._fine_base - np.float32(1))
        cv2.cvtColor(bins, cv2.COLOR_RGB2RGBA, dst=self._index)
        self._index[..., 3] = 0
        index = self._index.view(np.int32)[..., 0]
        self._flat.take(index, out=self._detail, mode="clip")
        return self._detail.view(np.float32).reshape(*index.shape, 2)


def coarse_size(rows: int, columns: int) -> tuple[int, int]:
    """Width and height of the coarse grid.

    A step that divides both sides is preferred: averaging over whole pixels is much faster.
    """
    ideal = max(1.0, (rows * columns / COARSE_PIXELS) ** 0.5)
    steps = range(max(1, round(0.6 * ideal)), round(1.6 * ideal) + 1)
    step = min(steps, key=lambda s: (rows % s + columns % s > 0, abs(s - ideal)))
    return max(1, columns // step), max(1, rows // step)


def prepared(pixels: NDArray[Any], marks: Bool | None, around_px: int) -> NDArray[Any]:
    """Intensities as every model sees them: marks filled from so far around, grain smoothed."""
    if marks is not None and around_px:
        pixels = fill_marks(pixels, marks, around_px)
    return smooth(pixels)


class Sampler:
    """Relative change and place of some pixels, exactly as :class:`SlopeField` sees them."""

    def __init__(self, reference: Float32, reference_marks: Bool | None, full_scale: float) -> None:
        self._around_px = around_marks(reference_marks)
        self._base = prepared(reference, reference_marks, self._around_px)
        self._place = place(reference.shape[:2])
        self._full_scale = full_scale

    def features(
        self,
        pixels: NDArray[Any],
        marks: Bool | None,
        rows: NDArray[np.int32],
        columns: NDArray[np.int32],
    ) -> Float32:
        """(N, K + 2) features of N pixels of one frame."""
        smoothed = prepared(pixels, marks, self._around_px)[rows, columns]
        base = self._base[rows, columns]
        change = relative_change(smoothed, base, full_scale=self._full_scale)
        return np.concatenate([change, self._place[rows, columns]], axis=1)
