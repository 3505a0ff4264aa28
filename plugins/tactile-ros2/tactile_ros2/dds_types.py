"""The types of ROS messages as DDS types, named as the middleware of ROS 2 names them."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

from cyclonedds.idl import make_idl_struct
from cyclonedds.idl import types as idl
from rosbags.interfaces import Nodetype

from tactile_rosbag.messages import types

# ROS 2 design, "Topic and Service name mapping to DDS": the prefix of a topic, and the namespace
# and the ending of a type, published at design.ros2.org/articles/topic_and_service_names.html and
# in rosidl_generator_dds_idl (certain: every middleware of ROS 2 does it)
_TOPIC_PREFIX = "rt"
_NAMESPACE, _ENDING = "dds_", "_"

_NOT_OF_IDL = {"bool": bool, "string": str, "byte": idl.uint8}


def dds_topic(topic: str) -> str:
    """Return the DDS name of a topic: ``rt/a/b`` for ``/a/b``."""
    return f"{_TOPIC_PREFIX}{topic}"


def dds_type_name(kind: str) -> str:
    """Return ``sensor_msgs::msg::dds_::Image_`` for ``sensor_msgs/msg/Image``."""
    package, folder, name = kind.split("/")
    return f"{package}::{folder}::{_NAMESPACE}::{name}{_ENDING}"


@cache
def struct_type(kind: str) -> Any:
    """Return the DDS type of a ROS message type such as ``sensor_msgs/msg/Image``."""
    return _make(kind)


@cache
def sample_type(kind: str) -> Any:
    """Return the same type for samples that are given, and arrive, as the bytes they travel as.

    They have one attribute, ``cdr``: the serialised message with its header of 4 bytes. The DDS
    library's own serialisation of an image, value by value in Python, takes longer than a frame.
    """
    made = _make(kind)
    made.serialize = _given_bytes
    made.deserialize = partial(sample_of, kind)
    return made


def sample_of(kind: str, cdr: bytes) -> Any:
    """Return a sample of :func:`sample_type` from its bytes."""
    made = sample_type(kind)
    sample = made.__new__(made)
    sample.cdr = cdr
    return sample


def _given_bytes(sample: Any, **_: object) -> Any:
    return sample.cdr


def _make(kind: str) -> Any:
    _, fields = types().fielddefs[kind]
    members = {name: _member(node) for name, node in fields}
    return make_idl_struct(kind.split("/")[-1], dds_type_name(kind), members)


def _member(node: Any) -> Any:
    form, content = node
    if form == Nodetype.NAME:
        return struct_type(content)
    if form == Nodetype.BASE:
        name = content[0]
        return _NOT_OF_IDL.get(name) or getattr(idl, name)
    inner, size = content
    array: Any = idl.array
    sequence: Any = idl.sequence
    return array[_member(inner), size] if form == Nodetype.ARRAY else sequence[_member(inner)]
