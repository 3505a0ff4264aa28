"""Divergence and curl of a displacement field."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.errors import InputError


def divergence(displacement_mm: Array, *, mm_per_px: float) -> Float32:
    """Return the divergence ∂u/∂x + ∂v/∂y, the areal strain of the gel surface.

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
        Dimensionless; positive where the surface expands, as under a normal load.

    Raises
    ------
    InputError
        The field is not (H, W, 2), or narrower than two pixels.
    """
    u, v = _parts(displacement_mm)
    return np.asarray((np.gradient(u, axis=1) + np.gradient(v, axis=0)) / np.float32(mm_per_px))


def curl(displacement_mm: Array, *, mm_per_px: float) -> Float32:
    """Return the curl ∂v/∂x − ∂u/∂y, twice the local rotation of the gel surface in rad.

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
        Dimensionless; positive where the surface rotates from x towards y.

    Raises
    ------
    InputError
        The field is not (H, W, 2), or narrower than two pixels.
    """
    u, v = _parts(displacement_mm)
    return np.asarray((np.gradient(v, axis=1) - np.gradient(u, axis=0)) / np.float32(mm_per_px))


def checked(displacement_mm: Array) -> Array:
    """Return the field after checking its shape.

    Raises
    ------
    InputError
        The field is not (H, W, 2), or narrower than two pixels.
    """
    shape = displacement_mm.shape
    if len(shape) != 3 or shape[2] != 2 or min(shape[:2]) < 2:
        raise InputError(f"a displacement field is (H, W, 2); this one is {shape}")
    return displacement_mm


def _parts(displacement_mm: Array) -> Float32:
    return np.asarray(np.moveaxis(checked(displacement_mm), 2, 0), np.float32, order="C")
