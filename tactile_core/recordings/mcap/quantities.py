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
from tactile_core.quantities import Image, Quantity
from tactile_core.quantities.fields import fields_of

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


FRAME = "sensor"  # Name of the frame of maps: origin at the image centre, x right, y down

_UNSAFE = re.compile(r"[^\w/]+")


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
    digits; vectors have one for each component.
    """
    yield QuantityMessage("summary", SUMMARY, json.dumps(reading.summary()).encode())
    for quantity in reading.quantities.values():
        yield from _maps(quantity, time_ns)


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
        width=width,
        height=height,
        encoding=encoding,
        step=len(data) // height,
        frame_id=FRAME,
        data=data,
    )
    message.timestamp.FromNanoseconds(time_ns)
    return QuantityMessage(topic, RAW_IMAGE, message.SerializeToString())
