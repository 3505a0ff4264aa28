"""The columns of images and of readings in an HDF5 file."""

from __future__ import annotations

import json
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.npz import DESCRIPTION, arrays_of
from tactile_core.interfaces.recording_writer import RecordedImage
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Image
from tactile_core.quantities.quantity import Guard, pass_errors
from tactile_hdf5.column_file import ColumnFile

# Groups: images, values of readings, and the number of the reading of each row of values.
IMAGES, READINGS, ROWS = "images/", "readings/", "reading_of/"

# Columns of bytes: the line of a reading, and the description of its arrays.
JSON = "readings_json", "quantities_json"

LEVELS = IMAGES + "levels/"  # Group with a column for each light

NONE = -1  # Stands for None in columns of integers; in those of floats it is NaN

_GRID = frozenset({"y", "x", "xy", "xyz"})  # Axes that have one length in all readings


class NumberColumn(NamedTuple):
    """A value of :meth:`RecordedImage.describe_image` as a column.

    Attributes
    ----------
    name : str
    dtype : str
    unit : str
    """

    name: str
    dtype: str
    unit: str = ""


# The columns of images besides the pixels and the lights.
NUMBERS = (
    NumberColumn("number", "i8"),
    NumberColumn("observation", "i8"),
    NumberColumn("exposure_index", "i8"),
    NumberColumn("timestamp_s", "f8", "s"),
    NumberColumn("wall_time_s", "f8", "s"),
    NumberColumn("sequence", "i8"),
    NumberColumn("exposure_time_s", "f8", "s"),
    NumberColumn("gain", "f8"),
)


class ImageColumns:
    """Writes images: bytes as the camera sent them, or pixels."""

    def __init__(self, file: ColumnFile) -> None:
        self._file = file
        self._count = 0
        self._lights: dict[str, None] = {}
        self._pixels: tuple[Any, ...] | None = None

    def write(self, recorded: RecordedImage) -> None:
        """Append an image.

        Raises
        ------
        InputError
            Its size or type is not that of the images before.
        """
        image, described = recorded.image, recorded.describe_image()
        compressed = image.encoded is not None
        if image.encoded is not None:
            self._file.append_bytes(IMAGES + "bytes", image.encoded)
        else:
            assert isinstance(image, Image)
            self._append_pixels(image.pixels)
        self._file.append(IMAGES + "compressed", np.array([compressed]))
        for column in NUMBERS:
            value = described[column.name]
            if value is None:
                value = np.nan if column.dtype == "f8" else NONE
            unit = {"unit": column.unit} if column.unit else None
            row = np.array([value], column.dtype)
            self._file.append(IMAGES + column.name, row, attributes=unit)
        self._lights.update(dict.fromkeys(recorded.levels))
        for name in self._lights:
            # NaN: the image does not name this light
            level = np.array([recorded.levels.get(name, np.nan)])
            self._file.append(LEVELS + name.replace("/", "_"), level, begin=self._count)
        self._count += 1

    def _append_pixels(self, pixels: NDArray[Any]) -> None:
        kind = (*pixels.shape, pixels.dtype)
        if self._pixels not in (None, kind):
            raise InputError(
                f"the camera's images have changed from {self._pixels} to {kind}; record them in a "
                f"new file"
            )
        self._pixels = kind
        self._file.append(IMAGES + "pixels", pixels[None], compressed=True)


class ReadingColumns:
    """Writes readings: a column for each array, as in the ``.npz`` of a reading.

    Every row has the number of its reading beside it. An array with as many rows as there are
    markers, or without a fixed length, adds as many rows.
    """

    def __init__(self, file: ColumnFile, guard: Guard = pass_errors) -> None:
        self._file = file
        self._guard = guard
        self._count = 0
        self._kinds: dict[str, list[tuple[Any, ...]]] = {}

    def write(self, reading: Reading) -> None:
        """Append a reading with all its quantities and inputs."""
        quantities = [*reading.quantities.values(), *reading.inputs.values()]
        mm_per_px = reading.frame.mm_per_px
        arrays = arrays_of(quantities, mm_per_px=mm_per_px, guard=self._guard)
        description = arrays.pop(DESCRIPTION).tobytes()
        units = _units(json.loads(description))
        line = json.dumps(reading.summary(self._guard)).encode()
        for column, content in zip(JSON, (line, description), strict=True):
            self._file.append_bytes(column, content)
        frame = reading.frame
        for name, value, unit in (
            ("frame_timestamp_s", frame.timestamp_s, "s"),
            ("frame_wall_time_s", frame.wall_time_s, "s"),
            ("frame_sequence", frame.sequence, ""),
        ):
            self._append(name, np.array([value]), {"unit": unit} if unit else {})
        for name, array in arrays.items():
            attributes = units.get(name, {})
            axes = attributes.get("axes", "").split()
            over_image = axes[0] in _GRID if axes else array.shape[:2] == frame.pixels.shape[:2]
            many = array.ndim > 0 and not over_image
            rows = array if many else array[None]
            self._append(name, _storable(rows), {**attributes, "rows": "many" if many else "one"})
        self._count += 1

    def _append(self, name: str, rows: NDArray[Any], attributes: dict[str, str]) -> None:
        """Append to the column of this name with this kind of rows; another kind gets its own."""
        kind = rows.shape[1:], rows.dtype
        kinds = self._kinds.setdefault(name, [])
        if kind not in kinds:
            kinds.append(kind)
        number = kinds.index(kind)
        column = name if number == 0 else f"{name}.{number + 1}"
        large = rows.ndim > 2
        self._file.append(READINGS + column, rows, attributes=attributes, compressed=large)
        self._file.append(ROWS + column, np.full(len(rows), self._count, np.int64))


def _units(described: dict[str, Any]) -> dict[str, dict[str, str]]:
    """Return unit, axes and quantity of each array, from the description of a reading."""
    found: dict[str, dict[str, str]] = {}
    for quantity, entry in described.items():
        for field in entry["fields"].values():
            name = entry["arrays"].get(field["saved_as"])
            if name is not None:
                attributes = {"quantity": quantity, "unit": field.get("unit", "")}
                if "axes" in field:
                    attributes["axes"] = " ".join(field["axes"])
                found.setdefault(name, attributes)
    return found


def _storable(rows: NDArray[Any]) -> NDArray[Any]:
    """Return text as UTF-8 of a fixed length, which is a power of two."""
    if rows.dtype.kind != "U":
        return rows
    encoded = np.char.encode(rows, "utf-8")
    # [bytes] names of states fit, so that no second column is needed
    length = max(64, encoded.dtype.itemsize)
    return encoded.astype(f"S{1 << (length - 1).bit_length()}")
