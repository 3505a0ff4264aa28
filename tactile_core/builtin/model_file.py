"""``model.npz`` in a bundle: the arrays of a fitted model, beside the shape of its images."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_core.builtin.image_shape import ImageShape
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz

Arrays = Mapping[str, NDArray[Any]]
Part = TypeVar("Part")


@dataclass(frozen=True)
class ModelFile:
    """The file of one model.

    Attributes
    ----------
    folder : Path
        The bundle's.
    use : str
        Name of the model, for the refusal of a file that holds none.
    """

    folder: Path
    use: str

    @property
    def path(self) -> Path:
        """The file."""
        return self.folder / "model.npz"

    def write(self, shape: ImageShape, arrays: Arrays, *, compressed: bool = False) -> None:
        """Write a model that was fitted on images of this shape."""
        save: Any = np.savez_compressed if compressed else np.savez
        save(self.path, shape=np.array(shape), **arrays)

    @contextmanager
    def read(self) -> Iterator[tuple[ImageShape, Arrays]]:
        """Lend shape and arrays to a ``with`` block that rebuilds the model from them.

        Raises
        ------
        CalibrationError
            The file is missing, broken or of another model, which the block may tell by a
            LookupError, TypeError, ValueError or OverflowError.
        """
        try:
            arrays = read_npz(self.path)
            height, width, channels = (int(n) for n in arrays["shape"])
            if min(height, width, channels) < 1:
                raise ValueError("no image has such a size")
            yield (height, width, channels), arrays
        except (InputError, ValueError, LookupError, TypeError, OverflowError) as error:
            raise CalibrationError(
                f"{self.path} does not hold a {self.use} model; calibrate again"
            ) from error


def arrays_of(part: Any) -> dict[str, NDArray[Any]]:
    """Return the fields of a dataclass of arrays and numbers, by name."""
    return {field.name: np.asarray(getattr(part, field.name)) for field in fields(part)}


def part_from(kind: type[Part], arrays: Arrays) -> Part:
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
