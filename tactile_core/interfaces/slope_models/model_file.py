"""``model.npz``: the arrays of a fitted model, beside the shape of its images."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.colour_table import Axis, ColourTable
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz
from tactile_core.interfaces.slope_models.image_shape import ImageShape

FILE = "model.npz"

Arrays = Mapping[str, NDArray[Any]]
T = TypeVar("T")


def write_model(
    folder: Path, shape: ImageShape, arrays: Arrays, *, compressed: bool = False
) -> None:
    """Write the arrays of a model that was fitted on images of this shape."""
    save: Any = np.savez_compressed if compressed else np.savez
    save(folder / FILE, shape=np.array(shape), **arrays)


@contextmanager
def stored_model(folder: Path) -> Iterator[tuple[ImageShape, Arrays]]:
    """Lend shape and arrays of a stored model to a ``with`` block that rebuilds it from them.

    Raises
    ------
    CalibrationError
        The file is missing, broken or of another model, which the block may tell by a LookupError,
        TypeError, ValueError or OverflowError.
    """
    path = folder / FILE
    try:
        arrays = read_npz(path)
        height, width, channels = (int(n) for n in arrays["shape"])
        if min(height, width, channels) < 1:
            raise ValueError("no image has such a size")
        yield (height, width, channels), arrays
    except (InputError, ValueError, LookupError, TypeError, OverflowError) as error:
        raise CalibrationError(f"{path} does not hold such a model; calibrate again") from error


def blur_from(arrays: Arrays, shape: ImageShape) -> float:
    """Standard deviation in px of a model's smoothing, of the array ``blur_px``.

    Raises
    ------
    LookupError, TypeError, ValueError
        There is none, or no image of this shape is smoothed so.
    """
    blur_px = float(arrays["blur_px"])
    if not 0 <= blur_px <= max(shape[:2]):
        raise ValueError("no image is smoothed so")
    return blur_px


def arrays_of(part: Any) -> dict[str, NDArray[Any]]:
    """Return the fields of a dataclass of arrays and numbers, by name."""
    return {field.name: np.asarray(getattr(part, field.name)) for field in fields(part)}


def part_from(kind: type[T], arrays: Arrays) -> T:
    """Rebuild a dataclass from the arrays of its fields.

    Raises
    ------
    LookupError, TypeError
        An array is missing, or there are several numbers where the class has one.
    """
    described: Any = kind
    return kind(
        **{
            # a module that postpones its annotations has them as text
            field.name: float(arrays[field.name]) if field.type == "float" else arrays[field.name]
            for field in fields(described)
        }
    )


def table_arrays(table: ColourTable) -> dict[str, NDArray[Any]]:
    """Arrays of a table, by names that no model uses."""
    return {
        "table": table.normal_xy,
        "table_axis": np.array([table.axis.per_unit, table.axis.first]),
        "table_points": np.array(table.points),
    }


def table_from(arrays: Arrays) -> ColourTable:
    """Rebuild a table from its arrays.

    Raises
    ------
    LookupError, ValueError
        They are missing, or no table.
    """
    per_unit, first = arrays["table_axis"]
    normal_xy = np.asarray(arrays["table"], np.complex64)
    if normal_xy.ndim != 3 or len(set(normal_xy.shape)) != 1:
        raise ValueError("a table is a cube")
    axis = Axis(float(per_unit), int(first), len(normal_xy))
    return ColourTable(axis, normal_xy, int(arrays["table_points"]))
