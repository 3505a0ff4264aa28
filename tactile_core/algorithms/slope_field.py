"""From one observation to slopes: a model of change and place, over a whole image.

Evaluating a network or a polynomial at every pixel costs tens of milliseconds. Its dependence on
place is smooth, so on large three-channel images it is evaluated on a coarse grid, and a table of
the same model over colour alone gives the detail between: slopes = table − smoothed table + model
on the coarse grid. Small images and other channel counts take the model everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.colour_table import ColourTable, as_complex, to_gradient
from tactile_core.algorithms.photometric import (
    DARK_FRACTION,
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

COARSE_PIXELS = 4_800
"""About so many points has the coarse grid."""

_RATIO_ONE = 64
"""The byte that stands for an unchanged intensity."""


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
        base = prepared(reference, reference_marks)
        h, w = base.shape[:2]
        self._table = table if base.shape[2] == 3 and h * w > EXACT_PIXELS else None
        if self._table is None:
            self._base = base
            self._place = place((h, w)).reshape(-1, 2)
            return
        step = max(1, round((h * w / COARSE_PIXELS) ** 0.5))
        self._coarse = (max(1, w // step), max(1, h // step))
        self._base = cv2.resize(base, self._coarse, interpolation=cv2.INTER_AREA)
        everywhere = place((h, w))
        self._place = cv2.resize(everywhere, self._coarse, interpolation=cv2.INTER_AREA)
        self._place = self._place.reshape(-1, 2)
        self._fine_base = np.maximum(base, np.float32(DARK_FRACTION * full_scale))
        self._base_u8 = np.rint(self._fine_base).clip(1, 255).astype(np.uint8)
        self._flat = self._table.flat()
        ratios = np.arange(256, dtype=np.float32)[:, None] / _RATIO_ONE - 1
        self._bin_of = np.ascontiguousarray(self._table.bins(np.repeat(ratios, 3, 1))[None])

    def measure(self, pixels: NDArray[Any], marks: Bool | None = None) -> tuple[Float32, Float32]:
        """Slopes ∂z/∂x and ∂z/∂y, two (H, W) float32 planes.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marks : (H, W) bool, optional
            Pixels that show a marker; their slope is that of the skin around them.
        """
        smoothed = prepared(pixels, marks)
        h, w = smoothed.shape[:2]
        if self._table is None:
            both = self._from_model(smoothed).reshape(h, w, 2)
            return np.ascontiguousarray(both[..., 0]), np.ascontiguousarray(both[..., 1])
        detail = self._from_table(smoothed).view(np.float32).reshape(h, w, 2)
        coarse = cv2.resize(smoothed, self._coarse, interpolation=cv2.INTER_AREA)
        wanted = self._from_model(coarse).reshape(*coarse.shape[:2], 2)
        wanted -= cv2.resize(detail, self._coarse, interpolation=cv2.INTER_AREA)
        detail += cv2.resize(wanted, (w, h), interpolation=cv2.INTER_LINEAR)
        gx, gy = cv2.split(detail)
        return np.asarray(gx, np.float32), np.asarray(gy, np.float32)

    def _from_model(self, smoothed: NDArray[Any]) -> Float32:
        change = relative_change(smoothed, self._base, full_scale=self._full_scale)
        features = np.concatenate([change.reshape(-1, change.shape[-1]), self._place], 1)
        return to_gradient(self._model(features))

    def _from_table(self, smoothed: NDArray[Any]) -> NDArray[np.complex64]:
        assert self._table is not None
        if smoothed.dtype == np.uint8:
            ratio = cv2.divide(smoothed, self._base_u8, scale=_RATIO_ONE)
            bins = cv2.LUT(ratio, self._bin_of)
        else:
            bins = self._table.bins(smoothed / self._fine_base - np.float32(1))
        four = cv2.cvtColor(bins, cv2.COLOR_RGB2RGBA)
        four[..., 3] = 0
        return self._flat.take(four.view(np.int32)[..., 0], mode="clip")


def prepared(pixels: NDArray[Any], marks: Bool | None) -> NDArray[Any]:
    """Intensities as every model sees them: marks filled, grain smoothed."""
    if marks is not None and marks.any():
        pixels = fill_marks(pixels, marks, _around(marks))
    return smooth(pixels)


def _around(marks: Bool) -> int:
    """Side of a neighbourhood that reaches the skin on all sides of each mark."""
    _, _, boxes, _ = cv2.connectedComponentsWithStats(marks.view(np.uint8))
    sides = boxes[1:, cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1]
    return int(np.median(sides.max(1))) * 2 + 1


def features_at(
    pixels: NDArray[Any],
    marks: Bool | None,
    base: Float32,
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    full_scale: float,
) -> Float32:
    """(N, K + 2) relative change and place of some pixels, exactly as :class:`SlopeField` sees them.

    Parameters
    ----------
    base : (H, W, K) float32
        The reference as :func:`prepared` gives it.
    """
    smoothed = prepared(pixels, marks)
    change = relative_change(smoothed[rows, columns], base[rows, columns], full_scale=full_scale)
    where = place(pixels.shape[:2])[rows, columns]
    return np.concatenate([change, where], axis=1)


__all__ = ["COARSE_PIXELS", "EXACT_PIXELS", "SlopeField", "as_complex", "features_at", "prepared"]
