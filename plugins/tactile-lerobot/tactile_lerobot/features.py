"""Features of a data set: columns whose values all have one shape."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from tactile_core.errors import InputError

MOST_AXES = 5  # Axes of the largest array that a data set can hold


@dataclass
class Feature:
    """A column, as far as its values are known.

    Attributes
    ----------
    dtype : numpy.dtype
    shape : tuple of int
        The largest length of each axis; () for a number.
    rows : int
        Number of values.
    varies : bool
        Whether values have different lengths.
    described : dict
        Unit and axes.
    """

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    rows: int = 0
    varies: bool = False
    described: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def from_value(cls, value: NDArray[Any], described: dict[str, Any]) -> Feature:
        """Return the feature of a first value."""
        return cls(value.dtype, value.shape, described=described)

    def add(self, name: str, value: NDArray[Any]) -> None:
        """Widen the feature until it can hold this value, too.

        Raises
        ------
        InputError
            The value has another number of axes, or more than a data set can hold.
        """
        if value.ndim != len(self.shape) or value.ndim > MOST_AXES:
            raise InputError(
                f"{name} has {value.ndim} axes, where a LeRobot data set needs the same number in "
                f"every reading, at most {MOST_AXES}; leave it out with the option 'leave_out'"
            )
        self.varies |= value.shape != self.shape
        self.shape = tuple(map(max, self.shape, value.shape))
        if value.dtype != self.dtype:
            self.dtype = np.promote_types(value.dtype, self.dtype)
        self.rows += 1

    @property
    def info(self) -> dict[str, Any]:
        """Return the entry of ``info.json``."""
        text = self.dtype.kind == "U"
        return {
            "dtype": "string" if text else self.dtype.name,
            "shape": list(self.shape or (1,)),
            "names": None,
            **({"info": self.described} if self.described else {}),
        }

    def pad_value(self, value: NDArray[Any] | None) -> NDArray[Any]:
        """Return a value at the feature's shape; what is missing is NaN, -1, 0 or False."""
        if value is not None and value.shape == self.shape:
            return value.astype(self.dtype, copy=False)
        missing = {"f": np.nan, "i": -1, "U": ""}.get(self.dtype.kind, 0)
        full = np.full(self.shape, missing, self.dtype)
        if value is not None:
            full[tuple(slice(n) for n in value.shape)] = value
        return full

    def column(self, values: list[NDArray[Any]]) -> pa.Array:
        """Return padded values as a column of nested lists."""
        if self.dtype.kind == "U":
            return pa.array([str(value) for value in values], pa.string())
        flat: pa.Array = pa.array(np.stack(values).reshape(-1))
        for length in reversed(self.shape or ()):
            if length == 0:
                return pa.array([value.tolist() for value in values])
            ends = np.arange(0, len(flat) + 1, length, dtype=np.int32)
            flat = pa.ListArray.from_arrays(ends, flat)
        return flat
