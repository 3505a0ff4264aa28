"""A field of displacements as complex numbers x + iy, at a scale at which it is quick to judge."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex64]
Float32 = NDArray[np.float32]

_COLUMNS = 80
"""A displacement between marks a millimetre apart has no more to tell."""


def stride_of(width_px: int) -> int:
    """Every how many pixels a field is looked at."""
    return max(1, width_px // _COLUMNS)


def coarse(displacement_mm: NDArray[Any], stride: int) -> Complex:
    """(h, w) complex mm: every so many pixels of a field (H, W, 2), from the middle of each."""
    first = stride // 2
    picked = displacement_mm[first::stride, first::stride]
    return np.ascontiguousarray(picked, np.float32).view(np.complex64)[..., 0]


def since(now: Complex, before: Complex, spacing_mm: float) -> Complex:
    """How far the skin now at each place has moved since an earlier field, mm.

    Parameters
    ----------
    now, before : (h, w) complex64
        Each belongs to the skin that was at the place at its time.
    spacing_mm : float
        Distance of neighbouring places.

    Returns
    -------
    (h, w) complex64
    """
    columns, rows = _places(now.shape)
    moved = now - before
    # the same skin was elsewhere then: twice is enough, for displacements change slowly in space
    for _ in range(2):
        came = moved * np.float32(1 / spacing_mm)
        was = cv2.remap(
            _parts(before),
            columns - came.real,
            rows - came.imag,
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        moved = now - was.view(np.complex64)[..., 0]
    return moved


def strain(displacement: Complex, spacing_mm: float) -> Float32:
    """(h, w) by how much the skin is stretched or sheared: 0 where it moves as a rigid body."""
    scale = 1 / (8 * spacing_mm)
    parts = _parts(displacement)
    along = cv2.Sobel(parts, cv2.CV_32F, 1, 0, ksize=3, scale=scale)
    down = cv2.Sobel(parts, cv2.CV_32F, 0, 1, ksize=3, scale=scale)
    shear = along[..., 1] + down[..., 0]
    return np.asarray(np.sqrt(along[..., 0] ** 2 + down[..., 1] ** 2 + 0.5 * shear**2))


@lru_cache(maxsize=4)
def places_mm(shape: tuple[int, ...], spacing_mm: float) -> Complex:
    """(h, w) complex: where each value of such a field is, from the field's middle."""
    columns, rows = _places(shape)
    middle = complex(shape[1] - 1, shape[0] - 1) / 2
    places = np.asarray((columns + 1j * rows - middle) * spacing_mm, np.complex64)
    places.flags.writeable = False
    return places


@lru_cache(maxsize=4)
def _places(shape: tuple[int, ...]) -> tuple[Float32, Float32]:
    columns, rows = np.meshgrid(
        np.arange(shape[1], dtype=np.float32), np.arange(shape[0], dtype=np.float32)
    )
    return columns, rows


def _parts(field: Complex) -> Float32:
    return field.view(np.float32).reshape(*field.shape, 2)
