"""What a displacement field does around each pixel: it spreads, or it turns."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError

Array = NDArray[Any]
Float32 = NDArray[np.float32]


def divergence(displacement_mm: Array, *, mm_per_px: float) -> Float32:
    """Return ∂u/∂x + ∂v/∂y: how much the skin spreads.

    Central differences; one-sided at the border of the image.

    Parameters
    ----------
    displacement_mm : (H, W, 2)
        u and v: +x right, +y down.
    mm_per_px : float
        Scale of the image.

    Returns
    -------
    (H, W) float32
        Dimensionless; positive where the skin is stretched, as around a normal load.

    Raises
    ------
    InputError
        The field is not (H, W, 2), or narrower than two pixels.
    """
    u, v = _parts(displacement_mm)
    return (_across(u) + _down(v)) / np.float32(mm_per_px)


def curl(displacement_mm: Array, *, mm_per_px: float) -> Float32:
    """Return ∂v/∂x − ∂u/∂y: twice the angle in rad by which the skin is turned.

    Central differences; one-sided at the border of the image.

    Parameters
    ----------
    displacement_mm : (H, W, 2)
        u and v: +x right, +y down.
    mm_per_px : float
        Scale of the image.

    Returns
    -------
    (H, W) float32
        Dimensionless; positive where the skin is turned from x towards y.

    Raises
    ------
    InputError
        The field is not (H, W, 2), or narrower than two pixels.
    """
    u, v = _parts(displacement_mm)
    return (_across(v) - _down(u)) / np.float32(mm_per_px)


def checked(displacement_mm: Array) -> Array:
    """Return the field.

    Raises
    ------
    InputError
        It is not (H, W, 2), or narrower than two pixels.
    """
    shape = displacement_mm.shape
    if len(shape) != 3 or shape[2] != 2 or min(shape[:2]) < 2:
        raise InputError(f"a displacement field is (H, W, 2); this one is {shape}")
    return displacement_mm


def _parts(displacement_mm: Array) -> list[Float32]:
    field = np.asarray(checked(displacement_mm), np.float32)
    return [np.asarray(part) for part in cv2.split(field)]


def _across(part: Float32) -> Float32:
    slope = np.asarray(cv2.Sobel(part, cv2.CV_32F, 1, 0, ksize=1, scale=0.5), np.float32)
    slope[:, 0], slope[:, -1] = part[:, 1] - part[:, 0], part[:, -1] - part[:, -2]
    return slope


def _down(part: Float32) -> Float32:
    slope = np.asarray(cv2.Sobel(part, cv2.CV_32F, 0, 1, ksize=1, scale=0.5), np.float32)
    slope[0], slope[-1] = part[1] - part[0], part[-1] - part[-2]
    return slope
