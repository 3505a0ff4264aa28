"""Names in an MCAP recording: topics, schemas and encodings."""

from __future__ import annotations

from functools import cache
from types import MappingProxyType
from typing import Any

from tactile_core.errors import InputError
from tactile_core.quantities import Image

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
