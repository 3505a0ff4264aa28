"""``model.npz``: the arrays of a fitted model and the shape of its images."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.slopes.colour_table import Axis, ColourTable
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz
from tactile_core.interfaces.slope_models.samples import ImageShape

FILE = "model.npz"  # Name of the file in the model's folder

Arrays = Mapping[str, NDArray[Any]]
T = TypeVar("T")


def write_model(folder: Path, shape: ImageShape, arrays: Arrays) -> None:
    """Write the arrays of a model that was fitted to images of this shape."""
    save: Any = np.savez  # its type takes no arrays by name
    save(folder / FILE, shape=np.array(shape), **arrays)


@contextmanager
def stored_model(folder: Path) -> Iterator[tuple[ImageShape, Arrays]]:
    """Read shape and arrays of a stored model for a ``with`` block that rebuilds the model.

    Raises
    ------
    CalibrationError
        The file is missing, damaged or of another model. The block signals the latter by a
        LookupError, TypeError, ValueError or OverflowError.
    """
    path = folder / FILE
    try:
        arrays = read_npz(path)
        height, width, channels = (int(n) for n in arrays["shape"])
        if min(height, width, channels) < 1:
            raise ValueError("an image has at least one pixel and one channel")
        yield (height, width, channels), arrays
    except (InputError, ValueError, LookupError, TypeError, OverflowError) as error:
        raise CalibrationError(f"{path} does not hold such a model; calibrate again") from error


def blur_from(arrays: Arrays, shape: ImageShape, name: str = "blur_px") -> float:
    """Read the standard deviation in px of a model's smoothing from the array of this name.

    Raises
    ------
    LookupError, TypeError, ValueError
        The array is missing, or its value implausible for images of this shape.
    """
    blur_px = float(arrays[name])
    if not 0 <= blur_px <= max(shape[:2]):
        raise ValueError(f"{name} is negative or larger than the image")
    return blur_px


def arrays_of(part: Any) -> dict[str, NDArray[Any]]:
    """Return the fields of a dataclass of arrays and numbers as arrays, by name."""
    return {field.name: np.asarray(getattr(part, field.name)) for field in fields(part)}


def part_from(kind: type[T], arrays: Arrays) -> T:
    """Rebuild a dataclass from the arrays of its fields.

    Raises
    ------
    LookupError, TypeError
        An array is missing, or holds several numbers for a scalar field.
    """
    described: Any = kind
    return kind(
        **{
            # with postponed annotations a field's type is text
            field.name: float(arrays[field.name]) if field.type == "float" else arrays[field.name]
            for field in fields(described)
        }
    )


def table_arrays(table: ColourTable) -> dict[str, NDArray[Any]]:
    """Return the arrays of a table, under names that no model uses."""
    return {
        "table": table.normal_xy,
        "table_axis": np.array([table.axis.per_unit, table.axis.first]),
    }


def table_from(arrays: Arrays) -> ColourTable:
    """Rebuild a table from its arrays.

    Raises
    ------
    LookupError, ValueError
        Arrays are missing, or are not those of a table.
    """
    per_unit, first = arrays["table_axis"]
    normal_xy = np.asarray(arrays["table"], np.complex64)
    if normal_xy.ndim != 3 or len(set(normal_xy.shape)) != 1:
        raise ValueError("the array of a table is a cube")
    axis = Axis(float(per_unit), int(first), len(normal_xy))
    return ColourTable(axis, normal_xy)
