"""``lerobot.dataset``: a LeRobot v3 data set with one episode."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Iterator
from typing import Any, ClassVar

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from pydantic import BaseModel, Field, PositiveInt

from tactile_core.formats.npz import DESCRIPTION, arrays_of
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.sink import Reading, Session, Sink
from tactile_core.quantities import Image
from tactile_lerobot import metadata
from tactile_lerobot.features import Feature
from tactile_lerobot.rows import Picture, Row, RowFile, Statistics, components, image_components

_IMAGE_TYPE = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
_NOMINAL_FPS = 30  # Rate of a data set of a single frame, Hz


class DatasetOptions(Options):
    """Options of ``lerobot.dataset``."""

    task: str = Field(default="touch", min_length=1, description="What is done, in words.")
    fps: PositiveInt | None = Field(
        default=None, description="Frames a second. Default: as the timestamps say, rounded."
    )
    leave_out: tuple[str, ...] = Field(
        default=(),
        description="Names of arrays, as in the .npz of a reading, that are not written.",
    )


class Dataset(Sink):
    """A folder ``NAME.lerobot`` with images and all quantities of every reading.

    Images are ``observation.images.<name>``, with a JPEG of the camera as the same bytes. Arrays
    are ``observation.<name>``, with their names in the ``.npz`` of a reading. ``meta/info.json``
    has unit and axes of each. The data set is complete once the sink is closed.
    """

    Options: ClassVar[type[BaseModel]] = DatasetOptions
    session_ending: ClassVar[str] = ".lerobot"
    keeps_raw: ClassVar[bool] = True

    def __init__(self, options: DatasetOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._rows: RowFile | None = None

    def open(self, session: Session) -> None:
        """Create the folder."""
        super().open(session)
        self._path = self.new_path()
        self._path.mkdir()
        self._rows = RowFile(self._path / ".rows")
        self._features: dict[str, Feature] = {}
        self._images: dict[str, dict[str, Any]] = {}
        self._times_s: list[float] = []

    def write(self, reading: Reading) -> None:
        """Keep the images and arrays of a reading."""
        frame = reading.frame
        arrays = self._arrays(reading)
        pictures: dict[str, Picture] = {}
        for name, image in frame.pictures().items():
            if image.pixels.dtype == np.uint8:
                key = f"observation.images.{name}"
                pictures[key] = _picture(image, f"{name}-{len(self._times_s):06d}")
                self._images.setdefault(key, _image_info(image))
            else:  # image files of more bits are not read as such by LeRobot
                self._add(arrays, f"observation.{name}", image.pixels, {})
        if self._rows is None:
            raise OSError(f"{self._path} is closed")
        self._rows.append(Row(pictures, arrays))
        self._times_s.append(frame.timestamp_s)

    def close(self) -> None:
        """Write the data set; one without a frame is not written."""
        if self._rows is None:
            return
        rows, self._rows = self._rows, None
        try:
            if self._times_s:
                self._write(rows)
        finally:
            rows.close()
            if not self._times_s:
                shutil.rmtree(self._path, ignore_errors=True)

    def _arrays(self, reading: Reading) -> dict[str, NDArray[Any]]:
        quantities = [*reading.quantities.values(), *reading.inputs.values()]
        frame, guard = reading.frame, self.session.guard
        saved = arrays_of(quantities, mm_per_px=frame.mm_per_px, guard=guard)
        described = _describe_arrays(json.loads(saved.pop(DESCRIPTION).tobytes()))
        described["mm_per_px"] = {"unit": "mm/px"}
        found: dict[str, NDArray[Any]] = {}
        for name, array in saved.items():
            if name not in self._settings.leave_out:
                self._add(found, f"observation.{name}", array, described.get(name, {}))
        # LeRobot reads numbers as float32, which cannot hold a time
        for name, time_s in (
            ("timestamp_ns", frame.timestamp_s),
            ("wall_time_ns", frame.wall_time_s),
        ):
            self._add(found, f"observation.{name}", _nanoseconds(time_s), {"unit": "ns"})
        return found

    def _add(
        self,
        found: dict[str, NDArray[Any]],
        key: str,
        array: NDArray[Any],
        described: dict[str, Any],
    ) -> None:
        if array.dtype.kind == "U" and array.ndim > 0:
            array = np.asarray(json.dumps(array.tolist(), ensure_ascii=False))
        key = key.replace("/", ".")
        self._features.setdefault(key, Feature.from_value(array, described)).add(key, array)
        found[key] = array

    def _write(self, rows: RowFile) -> None:
        count, fps = len(self._times_s), self._settings.fps or _fps(self._times_s)
        ticks = _ticks(self._times_s, fps)
        counted = [k for k, f in self._features.items() if f.varies or f.rows < count]
        for key in counted:
            self._features[f"{key}.count"] = Feature(np.dtype(np.int64), ())
        infos = {key: feature.info for key, feature in self._features.items()}
        statistics: dict[str, Statistics] = {}
        data = self._path / metadata.DATA
        data.parent.mkdir(parents=True)
        writer: pq.ParquetWriter | None = None
        try:
            for begin, group in _groups(rows):
                seconds = ticks[begin : begin + len(group)] / fps
                table = self._table(begin, group, seconds, counted, statistics)
                if writer is None:
                    writer = pq.ParquetWriter(data, table.schema)
                writer.write_table(table)
        finally:
            if writer is not None:
                writer.close()
        results = {key: found.result() for key, found in statistics.items()}
        metadata.write_json(self._path / metadata.STATISTICS, results)
        metadata.write_tasks(self._path / metadata.TASKS, self._settings.task)
        metadata.write_episodes(self._path / metadata.EPISODES, count, self._settings.task, results)
        # last, because a data set without it is none
        info = metadata.info_of(count, fps, {**self._images, **infos}, self.session.build.name)
        metadata.write_json(self._path / metadata.INFO, info)

    def _table(
        self,
        begin: int,
        group: list[Row],
        seconds: NDArray[np.float64],
        counted: list[str],
        statistics: dict[str, Statistics],
    ) -> pa.Table:
        """Return consecutive rows as a table, and add them to the statistics."""
        columns: dict[str, pa.Array] = {}
        for key, info in self._images.items():
            pictures = [row.pictures.get(key) for row in group]
            cells = [None if p is None else {"bytes": p.content, "path": p.name} for p in pictures]
            columns[key] = pa.array(cells, _IMAGE_TYPE)
            shape = (info["shape"][2], 1, 1)
            for picture in pictures:
                if picture is not None:
                    statistics.setdefault(key, Statistics(shape)).add(picture.values)
        for key, feature in self._features.items():
            if key.removesuffix(".count") in counted and key.endswith(".count"):
                values = [_count(row.arrays.get(key.removesuffix(".count"))) for row in group]
            else:
                values = [feature.pad_value(row.arrays.get(key)) for row in group]
            columns[key] = feature.column(values)
            if feature.dtype.kind != "U":
                for value in values:
                    flat, components_shape = components(value)
                    if flat.size:
                        statistics.setdefault(key, Statistics(components_shape)).add(flat)
        numbers = np.arange(begin, begin + len(group))
        indices = {"timestamp": seconds, "frame_index": numbers, "index": numbers}
        for name, dtype in metadata.INDICES.items():
            column = indices.get(name, np.zeros(len(group))).astype(dtype)
            columns[name] = pa.array(column)
            for number in column:
                statistics.setdefault(name, Statistics((1,))).add(number.reshape(1, 1))
        return pa.table(columns)


def _picture(image: Image, name: str) -> Picture:
    values, _ = image_components(image.pixels)
    if image.encoded is not None:
        ending = "png" if image.encoded.startswith(b"\x89PNG") else "jpg"
        return Picture(image.encoded, f"{name}.{ending}", values)
    pixels = image.pixels if image.pixels.ndim == 2 else image.pixels[..., ::-1]
    _, encoded = cv2.imencode(".png", np.ascontiguousarray(pixels))
    return Picture(encoded.tobytes(), f"{name}.png", values)


def _image_info(image: Image) -> dict[str, Any]:
    rows, columns = image.pixels.shape[:2]
    channels = 1 if image.pixels.ndim == 2 else image.pixels.shape[2]
    return {
        "dtype": "image",
        "shape": [rows, columns, channels],
        "names": ["height", "width", "channels"],
    }


def _describe_arrays(quantities: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return unit, axes and quantity of each array, from the description of a reading."""
    found: dict[str, dict[str, Any]] = {}
    for quantity, entry in quantities.items():
        for spec in entry["fields"].values():
            name = entry["arrays"].get(spec["saved_as"])
            if name is not None:
                values = {"quantity": quantity, "unit": spec.get("unit"), "axes": spec.get("axes")}
                found.setdefault(name, {k: v for k, v in values.items() if v is not None})
    return found


def _count(value: NDArray[Any] | None) -> NDArray[Any]:
    """Return how many rows of a value are not padding."""
    if value is None:
        return np.asarray(0)
    return np.asarray(1 if value.ndim == 0 else len(value))


def _nanoseconds(time_s: float) -> NDArray[np.int64]:
    rest, seconds = math.modf(time_s)
    return np.asarray(int(seconds) * 1_000_000_000 + round(rest * 1e9), np.int64)


def _fps(times_s: list[float]) -> int:
    steps = np.diff(times_s)
    steps = steps[steps > 0]
    return max(1, round(1 / float(np.median(steps)))) if len(steps) else _NOMINAL_FPS


def _ticks(times_s: list[float], fps: int) -> NDArray[np.int64]:
    """Return the time of each frame in periods of the rate, so that a gap stays one.

    LeRobot expects multiples of the period where no frame is missing, not the camera's jitter.
    """
    # rising, whatever the jitter: number n is at least one more than the one before
    numbers = np.arange(len(times_s))
    nearest = np.rint((np.array(times_s) - times_s[0]) * fps).astype(np.int64)
    return np.asarray(np.maximum.accumulate(nearest - numbers) + numbers)


def _groups(rows: RowFile) -> Iterator[tuple[int, list[Row]]]:
    """Yield the number of the first row and the rows of groups of limited size."""
    group: list[Row] = []
    begin = size = 0
    for row in rows:
        group.append(row)
        size += sum(array.nbytes for array in row.arrays.values())
        size += sum(len(picture.content) for picture in row.pictures.values())
        if size > (1 << 25):  # [bytes] of a group of rows
            yield begin, group
            begin, group, size = begin + len(group), [], 0
    if group:
        yield begin, group
