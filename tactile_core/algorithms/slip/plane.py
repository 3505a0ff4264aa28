"""A field of displacements as complex numbers x + iy, at a scale at which it is quick to judge."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.gradient import gradient
from tactile_core.algorithms.arrays.places import nodes
from tactile_core.algorithms.arrays.types import Complex64, Float32, Intp

_COLUMNS = 80
"""A displacement between markers a millimetre apart has no more to tell."""


def stride_of(width_px: int) -> int:
    """Every how many pixels a field is looked at."""
    return max(1, width_px // _COLUMNS)


def coarse(displacement_mm: NDArray[Any], stride: int) -> Complex64:
    """(h, w) complex mm: every so many pixels of a field (H, W, 2), from the middle of each."""
    first = stride // 2
    field = np.ascontiguousarray(displacement_mm, np.float32).view(np.complex64)[..., 0]
    return np.ascontiguousarray(field[first::stride, first::stride])


def since(now: Complex64, before: Complex64, spacing_mm: float) -> Complex64:
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
    at, per_place = _nodes(now.shape), np.float32(1 / spacing_mm)
    moved = now - before
    # the same skin was elsewhere then: twice is enough, for displacements change slowly in space
    for _ in range(2):
        came_from = at - _parts(moved) * per_place
        was = cv2.remap(
            _parts(before),
            came_from,
            np.empty(0),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        moved = now - was.view(np.complex64)[..., 0]
    return moved


def strain(displacement: Complex64, spacing_mm: float, chosen: Intp) -> Float32:
    """(n,) by how much the skin is stretched or sheared: 0 where it moves as a rigid body.

    Parameters
    ----------
    displacement : (h, w) complex64
        In mm.
    spacing_mm : float
        Distance of neighbouring places.
    chosen : (n,) intp
        Places, counted along the rows.
    """
    along, down = (
        slope.reshape(-1, 2).take(chosen, axis=0)
        for slope in gradient(_parts(displacement), spacing_mm, smooth=True)
    )
    shear = along[:, 1] + down[:, 0]
    return np.asarray(np.sqrt(along[:, 0] ** 2 + down[:, 1] ** 2 + 0.5 * shear**2), np.float32)


@lru_cache(maxsize=4)
def places_mm(shape: tuple[int, ...], spacing_mm: float) -> Complex64:
    """(h, w) complex: where each value of such a field is, from the field's middle."""
    middle = complex(shape[1] - 1, shape[0] - 1) / 2
    places = np.asarray((_nodes(shape).view(np.complex64)[..., 0] - middle) * spacing_mm)
    places.flags.writeable = False
    return places


@lru_cache(maxsize=4)
def _nodes(shape: tuple[int, ...]) -> Float32:
    """(h, w, 2) column and row of each value."""
    return nodes(shape)


def _parts(field: Complex64) -> Float32:
    return field.view(np.float32).reshape(*field.shape, 2)
