"""Checks of the form of images and quantities: dtype, shape and finite values."""

from __future__ import annotations

from functools import cache
from math import isfinite
from numbers import Integral, Real
from typing import Any

import numpy as np

from tactile_core.quantities.fields import Field, fields_of
from tactile_core.quantities.observation import Image
from tactile_core.quantities.quantity import Quantity, waiting

# Largest value of an array; squares of such values still fit into float32 when summed up.
_LARGEST = 1e15

# Lengths of the axes that have the same meaning in every quantity.
_COMPONENTS = {"xy": 2, "xyz": 3}


def form_fault(quantity: Quantity, image: tuple[int, ...] | None = None) -> str:
    """Return what is wrong with a quantity's form; empty if it matches its annotations.

    Parameters
    ----------
    quantity : Quantity
    image : (rows, columns), optional
        Shape of the image that it was measured in.

    Returns
    -------
    str
        The first fault, e.g. ``HeightMap.mm has the shape …``.

    Raises
    ------
    PluginError
        The annotations of its class cannot be read.
    """
    kind, values = type(quantity), quantity.__dict__
    numbers, arrays = _checked_fields(kind)
    for field in numbers:
        value = values.get(field.name)
        # nearly all numbers are floats, and this takes a third of the time of the whole question
        if not (type(value) is float and field.form is float and isfinite(value)):
            wrong = _number_fault(getattr(quantity, field.name), field)
            if wrong:
                return f"{kind.__name__}.{field.name} {wrong}"
    lengths = dict(_COMPONENTS)
    if image is not None:
        lengths["y"], lengths["x"] = image[:2]
    on_demand = waiting(quantity)
    for field in arrays:
        name = field.name
        given = on_demand.get(name)
        value = getattr(quantity, name) if given is None else given.grid and given.grid.cells
        if value is None and (field.optional or given):
            continue
        coarse = field.spec.coarse or given is not None
        wrong = _array_fault(field, value, lengths, coarse=coarse)
        if wrong:
            return f"{kind.__name__}.{name} {wrong}"
    return ""


def _checked_fields(kind: type[Quantity]) -> tuple[tuple[Field, ...], tuple[Field, ...]]:
    """Return the fields of a class that are numbers, and those that are arrays."""
    hashable: Any = kind  # a class is, even if its instances are not
    return _kept_fields(hashable)


@cache
def _kept_fields(kind: type[Quantity]) -> tuple[tuple[Field, ...], tuple[Field, ...]]:
    fields = fields_of(kind)
    numbers = tuple(f for f in fields if f.form in (float, int))
    return numbers, tuple(f for f in fields if f.is_array)


def _array_fault(field: Field, value: Any, lengths: dict[str, int], *, coarse: bool) -> str:
    if not isinstance(value, np.ndarray) or (field.dtype and field.dtype != value.dtype):
        actual = getattr(value, "dtype", type(value).__name__)
        return f"is {actual} where it must be {field.dtype or 'an array'}"
    axes, shape = field.spec.axes, value.shape
    if axes is not None:
        if coarse and len(shape) == len(axes) and _tiles(shape, axes, lengths):
            axes, found = axes[2:], shape[2:]
        else:
            found = shape
        # the first array over an axis determines its length
        given = found if len(found) == len(axes) else (*found, *(0,) * len(axes))[: len(axes)]
        wanted = tuple(map(lengths.setdefault, axes, given))
        if found != wanted:
            whose = "image" if "y" in axes else "quantity"
            return f"has the shape {shape} where the {whose} has {wanted}"
    # a sum of squares is several times faster than to ask each value
    if value.dtype.kind == "f" and not isfinite(np.vdot(value, value)):
        if not np.isfinite(value).all():
            return "holds values that are not finite"
        if np.abs(value).max() > _LARGEST:
            return f"holds values above {_LARGEST:g}"
    return ""


def _tiles(shape: tuple[int, ...], axes: tuple[str, ...], lengths: dict[str, int]) -> bool:
    """Return whether a grid has no more rows and columns than the image."""
    rows, columns = shape[:2]
    down, across = axes[:2]
    return 0 < rows <= lengths.get(down, rows) and 0 < columns <= lengths.get(across, columns)


def _number_fault(value: Any, field: Field) -> str:
    if value is None and field.optional:
        return ""
    if isinstance(value, Integral):
        bits = int(value).bit_length()
        return "" if bits < 64 else f"is a number of {bits} bits where 64 are the most"
    if field.form is float and isinstance(value, Real) and isfinite(value):
        return ""
    return f"is {value!r} where it must be a {'whole ' if field.form is int else ''}number"


def writable_field(quantity: Quantity) -> str:
    """Return the name of an array that somebody has made writable again; empty if there is none."""
    values = quantity.__dict__
    for name in quantity.__dataclass_fields__:
        value = values.get(name)
        if isinstance(value, np.ndarray) and value.flags.writeable:
            return f"{type(quantity).__name__}.{name}"
    return ""


def image_fault(image: object) -> str:
    """Return what is wrong with the object that a camera returned; empty for a valid Image."""
    if not isinstance(image, Image):
        return f"returned {type(image).__name__} instead of an Image"
    pixels = image.pixels
    if not isinstance(pixels, np.ndarray) or pixels.dtype not in (np.uint8, np.uint16):
        kind = getattr(pixels, "dtype", type(pixels).__name__)
        return f"returned pixels of type {kind}, neither uint8 nor uint16"
    if not (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3)) or not pixels.size:
        return f"returned pixels of shape {pixels.shape}, neither (H, W) nor (H, W, 3)"
    return ""


def size_change(before_px: tuple[int, int], now_px: tuple[int, int]) -> str:
    """Return the sentence about images whose (width, height) changes in mid-stream."""
    (before, high), (now, now_high) = before_px, now_px
    return (
        f"the camera's images changed from {before} × {high} to {now} × {now_high} pixels; set the "
        f"camera to one size, and begin again"
    )
