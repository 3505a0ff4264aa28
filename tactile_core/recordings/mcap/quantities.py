"""Quantities in MCAP files, and their topics."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import cache
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import HeightMap, Image, Quantity
from tactile_core.quantities.fields import Points, fields_of

PROFILE = "tactile"  # Name in the header of the file

# Schema of the JSON before each image; both messages have the number of the image.
IMAGE_INFO = "tactile.ImageInfo"

EVENT = "tactile.Event"  # Schema of events

SUMMARY = "tactile.Summary"  # Schema of the line of `tactile run --json`

# Foxglove's schemas of images.
RAW_IMAGE, COMPRESSED_IMAGE = "foxglove.RawImage", "foxglove.CompressedImage"

REFERENCES = "references/"  # Beginning of the names of the attachments with later references

# Names that Foxglove and ROS give to pixels, by their channels and bytes; 16 bits are in
# little-endian order.
_ENCODINGS = MappingProxyType({(1, 1): "mono8", (3, 1): "rgb8", (1, 2): "mono16", (3, 2): "rgb16"})


def encoding_of(image: Image) -> str:
    """Return the name of the encoding of an image's pixels."""
    channels = 1 if image.pixels.ndim == 2 else image.pixels.shape[2]
    return _ENCODINGS[channels, image.pixels.dtype.itemsize]


def form_of(encoding: str) -> tuple[int, int] | None:
    """Return the channels and the bytes of each of an encoding; None if it is unknown."""
    return next((form for form, name in _ENCODINGS.items() if name == encoding), None)


def mcap_library(module: str) -> Any:
    """Import a module of the extra ``record``.

    Raises
    ------
    InputError
        It is not installed.
    """
    from importlib import import_module

    try:
        return import_module(module)
    except ImportError as error:
        raise InputError(
            "MCAP recordings need further libraries; install them with: pip install "
            "'tactile-core[record]'"
        ) from error


@cache
def schema_class(schema: str) -> Any:
    """Return the class of Foxglove's messages of a schema.

    Raises
    ------
    InputError
        The extra ``record`` is not installed.
    """
    name = schema.removeprefix("foxglove.")
    return getattr(mcap_library(f"foxglove_schemas_protobuf.{name}_pb2"), name)


# Foxglove's schemas of maps, point clouds and drawings.
GRID, POINTS, SCENE = "foxglove.Grid", "foxglove.PointCloud", "foxglove.SceneUpdate"

# Name of the sensor's frame: origin at the image centre, x right, y down, z away from the camera;
# lengths in Foxglove's schemas are in metres.
FRAME = "sensor"

_UNSAFE = re.compile(r"[^\w/]+")
# Pixels between two points of a point cloud, which is for looking at; the map has every pixel.
_POINT_STEP_PX = 4
_MARKER_MM = 0.2


class QuantityMessage(NamedTuple):
    """One message.

    Attributes
    ----------
    topic : str
        Below that of the sensor.
    schema : str
    data : bytes
    """

    topic: str
    schema: str
    data: bytes


def quantity_messages(reading: Reading, time_ns: int) -> Iterator[QuantityMessage]:
    """Yield the messages of a reading.

    Every field over the image is a raw image of its own, in the unit of the field and with all its
    digits; vectors have one for each component. Heights are also a grid and a point cloud, and
    points of the image, with the arrows to them, are a scene.
    """
    yield QuantityMessage("summary", SUMMARY, json.dumps(reading.summary()).encode())
    scale_mm = reading.frame.mm_per_px
    for quantity in reading.quantities.values():
        yield from _maps(quantity, time_ns)
        if isinstance(quantity, HeightMap):
            yield from _relief(quantity, scale_mm, time_ns)
        points = [layer for layer in quantity.layers() if isinstance(layer, Points)]
        if points:
            size = reading.frame.pixels.shape[:2]
            yield _scene(type(quantity).__name__, points, size, scale_mm, time_ns)


def _maps(quantity: Quantity, time_ns: int) -> Iterator[QuantityMessage]:
    fields = fields_of(type(quantity))
    saved = [field.spec.saved_as for field in fields]
    for field in fields:
        values = getattr(quantity, field.name)
        if values is None or not field.is_array or (field.spec.axes or ())[:2] != ("y", "x"):
            continue
        name = field.spec.saved_as.replace(".", "/")
        if saved.count(field.spec.saved_as) > 1:
            name += f"/{field.name}"
        planes = {"": values} if values.ndim == 2 else {}
        if values.ndim == 3:
            axes = "xyz" if field.spec.axes and field.spec.axes[-1].startswith("xy") else ""
            planes = {
                f"/{axes[index] if index < len(axes) else index}": values[..., index]
                for index in range(values.shape[2])
            }
        for suffix, plane in planes.items():
            yield _map(f"quantities/{_UNSAFE.sub('_', name)}{suffix}", plane, time_ns)


def _map(topic: str, plane: NDArray[Any], time_ns: int) -> QuantityMessage:
    if plane.dtype == np.bool_:
        encoding, stored = "mono8", np.where(plane, np.uint8(255), np.uint8(0))
    elif plane.dtype == np.uint8:
        encoding, stored = "mono8", plane
    else:
        encoding, stored = "32FC1", plane.astype("<f4")
    data = stored.tobytes()
    height, width = plane.shape
    message = schema_class(RAW_IMAGE)(
        width=width, height=height, encoding=encoding, step=len(data) // height, data=data
    )
    return _make_message(topic, RAW_IMAGE, message, time_ns)


def _relief(height: HeightMap, mm_per_px: float, time_ns: int) -> Iterator[QuantityMessage]:
    """Yield the heights as a grid and as a point cloud, in metres."""
    rows, columns = height.mm.shape
    cell_m = mm_per_px / 1e3
    grid = schema_class(GRID)(
        column_count=columns, row_stride=4 * columns, cell_stride=4, frame_id=FRAME
    )
    grid.pose.position.x, grid.pose.position.y = -columns * cell_m / 2, -rows * cell_m / 2
    grid.pose.orientation.w = 1.0
    grid.cell_size.x = grid.cell_size.y = cell_m
    _add_fields(grid, ("height",))
    grid.data = (height.mm / np.float32(1e3)).astype("<f4").tobytes()
    yield _make_message("quantities/height_grid", GRID, grid, time_ns)

    ys, xs = np.mgrid[0:rows:_POINT_STEP_PX, 0:columns:_POINT_STEP_PX]
    heights = height.mm[::_POINT_STEP_PX, ::_POINT_STEP_PX]
    x, y = _metres(np.stack([xs, ys], axis=-1), (rows, columns), mm_per_px)
    points = np.stack([x, y, -heights / 1e3], axis=-1).astype("<f4")
    cloud = schema_class(POINTS)(point_stride=12, frame_id=FRAME, data=points.tobytes())
    cloud.pose.orientation.w = 1.0
    _add_fields(cloud, ("x", "y", "z"))
    yield _make_message("quantities/height_points", POINTS, cloud, time_ns)


def _scene(
    name: str, layers: list[Points], size: tuple[int, ...], mm_per_px: float, time_ns: int
) -> QuantityMessage:
    """Return points as small balls, with lines from where they came."""
    update = schema_class(SCENE)()
    for number, layer in enumerate(layers):
        entity = update.entities.add(id=f"{name}_{number}", frame_id=FRAME)
        entity.timestamp.FromNanoseconds(time_ns)
        shown = np.isfinite(layer.px).all(axis=1)
        ends = np.stack(_metres(layer.px, size, mm_per_px), axis=-1)
        for x, y in ends[shown].tolist():
            ball = entity.spheres.add()
            ball.pose.position.x, ball.pose.position.y = x, y
            ball.pose.orientation.w = 1.0
            ball.size.x = ball.size.y = ball.size.z = _MARKER_MM / 1e3
            ball.color.r = ball.color.g = ball.color.b = ball.color.a = 1.0
        if layer.from_px is not None:
            begins = np.stack(_metres(layer.from_px, size, mm_per_px), axis=-1)
            shown &= np.isfinite(begins).all(axis=1)
            lines = entity.lines.add(type=2, thickness=2, scale_invariant=True)  # 2: a list
            lines.pose.orientation.w = 1.0
            lines.color.r = lines.color.a = 1.0
            for pair in np.stack([begins[shown], ends[shown]], axis=1).tolist():
                for x, y in pair:
                    lines.points.add(x=x, y=y)
    return _make_message(f"scene/{name}", SCENE, update, time_ns)


def _metres(
    px: NDArray[Any], size: tuple[int, ...], mm_per_px: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return x and y in the sensor's frame, m."""
    rows, columns = size[:2]
    scale_m = mm_per_px / 1e3
    return (px[..., 0] - (columns - 1) / 2) * scale_m, (px[..., 1] - (rows - 1) / 2) * scale_m


def _add_fields(message: Any, names: tuple[str, ...]) -> None:
    for number, name in enumerate(names):
        message.fields.add(name=name, offset=4 * number, type=7)  # 7: float32


def _make_message(topic: str, schema: str, message: Any, time_ns: int) -> QuantityMessage:
    if hasattr(message, "timestamp"):
        message.timestamp.FromNanoseconds(time_ns)
    if hasattr(message, "frame_id"):
        message.frame_id = FRAME
    return QuantityMessage(topic, schema, message.SerializeToString())
