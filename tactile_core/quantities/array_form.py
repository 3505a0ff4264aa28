"""The form that images and quantities must have: dtype, shape, and numbers that are numbers."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import zip_longest
from typing import Any

import numpy as np

from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Float32,
    Gradients,
    HeightMap,
    Image,
    MarkerDetections,
    MarkerField,
    Quantity,
    SlipState,
)

_F, _I, _B = np.float32, np.int32, np.bool_

ARRAYS: Mapping[type[Quantity], Mapping[str, tuple[Any, tuple[Any, ...]]]] = {
    Gradients: {"x": (_F, ("H", "W")), "y": (_F, ("H", "W")), "valid": (_B, ("H", "W"))},
    HeightMap: {"mm": (_F, ("H", "W")), "valid": (_B, ("H", "W"))},
    ContactMask: {"mask": (_B, ("H", "W"))},
    DisplacementField: {"mm": (_F, ("H", "W", 2)), "valid": (_B, ("H", "W"))},
    MarkerDetections: {"centres_px": (_F, ("N", 2)), "cut": (_B, ("N",))},
    MarkerField: {
        "ids": (_I, ("N",)),
        "reference_px": (_F, ("N", 2)),
        "px": (_F, ("N", 2)),
        "seen": (_B, ("N",)),
    },
}
"""Dtype and shape of each quantity's arrays, as their docstrings say."""


def form_fault(quantity: Quantity, image: tuple[int, ...] | None = None) -> str:
    """Say what is wrong with a quantity's form; empty where nothing is, or it is not the core's.

    Parameters
    ----------
    quantity : Quantity
    image : (rows, columns), optional
        Of the image that it was measured in.
    """
    kind = next((kind for kind in ARRAYS if isinstance(quantity, kind)), None)
    if kind is None:
        return _slip_fault(quantity) if isinstance(quantity, SlipState) else ""
    name = type(quantity).__name__
    sizes = {} if image is None else dict(zip("HW", image, strict=True))
    for field, (dtype, dimensions) in ARRAYS[kind].items():
        found = getattr(quantity, field)
        if not isinstance(found, np.ndarray) or found.dtype != dtype:
            said = getattr(found, "dtype", type(found).__name__)
            return f"{name}.{field} is {said} where it must be {np.dtype(dtype)}"
        # the first array of N markers says how many there are
        wanted = tuple(
            sizes.setdefault(size, given) if isinstance(size, str) else size
            for size, given in zip_longest(dimensions, found.shape[: len(dimensions)])
        )
        if found.shape != wanted:
            whose = "image" if "H" in dimensions else "quantity"
            return f"{name}.{field} has the shape {found.shape} where the {whose} has {wanted}"
        if dtype is _F and not _is_finite(found):
            return f"{name}.{field} holds values that are no numbers"
    return ""


def image_fault(image: object) -> str:
    """Say what is wrong with what a camera returns; empty where it is an Image of sound form."""
    if not isinstance(image, Image):
        return f"returned {type(image).__name__} instead of an Image"
    pixels = image.pixels
    if not isinstance(pixels, np.ndarray) or pixels.dtype not in (np.uint8, np.uint16):
        kind = getattr(pixels, "dtype", type(pixels).__name__)
        return f"returned pixels that are {kind}, neither uint8 nor uint16"
    if not (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3)) or not pixels.size:
        return f"returned pixels of the shape {pixels.shape}, neither (H, W) nor (H, W, 3)"
    return ""


def _is_finite(values: Float32) -> bool:
    # a sum is several times faster than looking at each value, and finite only if they are
    with np.errstate(over="ignore", invalid="ignore"):
        total = values.sum()
    return bool(np.isfinite(total) or np.isfinite(values).all())


def _slip_fault(slip: SlipState) -> str:
    if not isinstance(slip.degree, float | int) or not np.isfinite(slip.degree):
        return f"SlipState.degree is {slip.degree!r} where it must be a number"
    return ""
