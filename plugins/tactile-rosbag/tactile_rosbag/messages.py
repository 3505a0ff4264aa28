"""Makes ROS messages from images and from fields of quantities."""

from __future__ import annotations

import json
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from tactile_core.formats.headers import header
from tactile_core.quantities import Image, Quantity
from tactile_core.quantities.fields import Field
from tactile_rosbag.si_units import si_unit
from tactile_rosbag.wrenches import RosWrench

_BIGGEST_CHANNELS = 4  # Largest number of components of a pixel in an image of floats


@cache
def types() -> Any:
    """Return the message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


class Message(NamedTuple):
    """A message and its type.

    Attributes
    ----------
    type : str
    content : object
        Of the library rosbags.
    unit : str
        SI unit of its numbers.
    """

    type: str
    content: Any
    unit: str = ""


def make(kind: str, **fields: Any) -> Any:
    """Return a message of a type such as ``std_msgs/msg/Float32``."""
    return types().types[kind](**fields)


def header_of(stamp_ns: int, frame_id: str) -> Any:
    """Return a ``std_msgs/Header``."""
    seconds, rest = divmod(stamp_ns, 1_000_000_000)  # [ns/s]
    stamp = make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)


def image_message(pixels: NDArray[Any], encoding: str, head: Any, unit: str = "") -> Message:
    """Return (H, W) or (H, W, C) pixels as an ``Image`` of that encoding of ROS."""
    packed = np.ascontiguousarray(pixels)
    packed = packed.astype(packed.dtype.newbyteorder("<"), copy=False)
    rows, columns = pixels.shape[:2]
    kind = "sensor_msgs/msg/Image"
    content = make(
        kind,
        header=head,
        height=rows,
        width=columns,
        encoding=encoding,
        is_bigendian=0,
        step=packed.nbytes // rows,
        data=packed.reshape(-1).view(np.uint8),
    )
    return Message(kind, content, unit)


def camera_message(image: Image, head: Any) -> Message:
    """Return a ``CompressedImage`` with the camera's own bytes, or an ``Image``."""
    if image.encoded is not None:
        found = header(image.encoded)
        kind = "sensor_msgs/msg/CompressedImage"
        data = np.frombuffer(image.encoded, np.uint8)
        name = "png" if image.encoded.startswith(b"\x89PNG") else "jpeg"
        if found is not None and found.channels == 1:
            name = f"mono8; {name} compressed mono8"
        return Message(kind, make(kind, header=head, format=name, data=data))
    pixels = image.pixels
    colour = "mono" if pixels.ndim == 2 else "rgb"
    return image_message(pixels, f"{colour}{8 * pixels.dtype.itemsize}", head)


def field_message(quantity: Quantity, field: Field, head: Any) -> Message | None:
    """Return the message of a field: an image, numbers or text; None for what is neither."""
    value = getattr(quantity, field.name)
    if value is None or field.spec.shared:
        return None
    unit = si_unit(field.spec.unit)
    if not field.is_array:
        return _scalar(value, unit.factor, unit.name)
    axes = field.spec.axes or ()
    array: NDArray[Any] = quantity.full(field.name) if field.spec.coarse else value
    if array.dtype.kind not in "biuf":
        return Message("std_msgs/msg/String", _string(json.dumps(array.tolist())))
    if array.dtype.kind == "f" and unit.factor != 1:
        array = (array.astype(np.float64) * unit.factor).astype(array.dtype)
    if axes[:2] == ("y", "x"):
        found = _field_image(array, head)
        if found is not None:
            return found._replace(unit=unit.name)
    return _numbers(array, axes, unit.name)


def height_message(height_mm: NDArray[np.float32], head: Any) -> Message:
    """Return heights as an ``Image`` of 32FC1 in metres."""
    return image_message(
        (height_mm.astype(np.float64) * 1e-3).astype(np.float32), "32FC1", head, "m"
    )


def points_message(points_mm: NDArray[np.float32], head: Any) -> Message:
    """Return (H, W, 3) points as an organised ``PointCloud2`` in metres."""
    points = np.ascontiguousarray((points_mm.astype(np.float64) * 1e-3).astype("<f4"))
    rows, columns = points.shape[:2]
    # FLOAT32 of sensor_msgs/PointField
    fields = [
        make("sensor_msgs/msg/PointField", name=n, offset=4 * i, datatype=7, count=1)
        for i, n in enumerate("xyz")
    ]
    kind = "sensor_msgs/msg/PointCloud2"
    content = make(
        kind,
        header=head,
        height=rows,
        width=columns,
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=12 * columns,
        data=points.view(np.uint8).reshape(-1),
        is_dense=True,
    )
    return Message(kind, content, "m")


def wrench_message(wrench: RosWrench, head: Any) -> Message:
    """Return a ``WrenchStamped``."""
    force, torque = (
        make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)
        for x, y, z in (wrench.force_n, wrench.torque_nm)
    )
    kind = "geometry_msgs/msg/WrenchStamped"
    inside = make("geometry_msgs/msg/Wrench", force=force, torque=torque)
    return Message(kind, make(kind, header=head, wrench=inside), "N, N·m")


def _field_image(array: NDArray[Any], head: Any) -> Message | None:
    """Return a field over the image as an ``Image``; None if no encoding holds it."""
    channels = 1 if array.ndim == 2 else array.shape[2] if array.ndim == 3 else 0
    if not 1 <= channels <= _BIGGEST_CHANNELS:
        return None
    if array.dtype == np.bool_:
        return image_message(np.where(array, 255, 0).astype(np.uint8), f"8UC{channels}", head)
    letter = {"f4": "32F", "f8": "64F", "u1": "8U", "u2": "16U", "i1": "8S", "i2": "16S"}
    depth = letter.get(array.dtype.str[1:], "32S" if array.dtype.itemsize == 4 else "")
    return image_message(array, f"{depth}C{channels}", head) if depth else None


def _numbers(array: NDArray[Any], axes: tuple[str, ...], unit: str) -> Message:
    names = axes if len(axes) == array.ndim else tuple(f"axis_{n}" for n in range(array.ndim))
    sizes = array.shape
    dimensions = [
        make(
            "std_msgs/msg/MultiArrayDimension",
            label=name,
            size=size,
            stride=int(np.prod(sizes[number:])),
        )
        for number, (name, size) in enumerate(zip(names, sizes, strict=True))
    ]
    layout = make("std_msgs/msg/MultiArrayLayout", dim=dimensions, data_offset=0)
    letter, dtype = {"f": ("Float64", np.float64), "b": ("UInt8", np.uint8)}.get(
        array.dtype.kind, ("Int64", np.int64)
    )
    kind = f"std_msgs/msg/{letter}MultiArray"
    data = np.ascontiguousarray(array, dtype).reshape(-1)
    return Message(kind, make(kind, layout=layout, data=data), unit)


def _scalar(value: Any, factor: float, unit: str) -> Message:
    if isinstance(value, bool | np.bool_):
        return Message("std_msgs/msg/Bool", make("std_msgs/msg/Bool", data=bool(value)))
    if isinstance(value, float | np.floating):
        kind = "std_msgs/msg/Float64"
        return Message(kind, make(kind, data=float(value) * factor), unit)
    if isinstance(value, int | np.integer):
        return Message("std_msgs/msg/Int64", make("std_msgs/msg/Int64", data=int(value)), unit)
    text = value if isinstance(value, str) else json.dumps(value, default=str)
    return Message("std_msgs/msg/String", _string(text))


def _string(text: str) -> Any:
    return make("std_msgs/msg/String", data=text)
