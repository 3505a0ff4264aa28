"""Names and bytes on the wire are those of ROS 2."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed")

from cyclonedds.idl import IdlStruct

from tactile_ros2.dds_types import dds_topic, dds_type_name, sample_of, sample_type, struct_type
from tactile_ros2.topics import KINDS
from tactile_rosbag.messages import header_of, height_message, make, types

STAMP_NS = 1_700_000_000_250_000_001


def test_a_topic_has_the_prefix_of_ros() -> None:
    assert dds_topic("/tactile/unit_7/height") == "rt/tactile/unit_7/height"


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("sensor_msgs/msg/Image", "sensor_msgs::msg::dds_::Image_"),
        ("sensor_msgs/msg/PointCloud2", "sensor_msgs::msg::dds_::PointCloud2_"),
        ("geometry_msgs/msg/WrenchStamped", "geometry_msgs::msg::dds_::WrenchStamped_"),
        ("std_msgs/msg/Float32", "std_msgs::msg::dds_::Float32_"),
        ("std_msgs/msg/String", "std_msgs::msg::dds_::String_"),
        ("diagnostic_msgs/msg/DiagnosticArray", "diagnostic_msgs::msg::dds_::DiagnosticArray_"),
    ],
)
def test_types_are_named_as_rosidl_names_them(kind: str, name: str) -> None:
    announced: Any = sample_type(kind)
    assert dds_type_name(kind) == name
    assert announced.__idl__.idl_transformed_typename == name


def test_every_topic_has_one_of_these_types() -> None:
    assert {kind.message for kind in KINDS} == {
        "sensor_msgs/msg/Image",
        "sensor_msgs/msg/PointCloud2",
        "geometry_msgs/msg/WrenchStamped",
        "std_msgs/msg/Float32",
        "std_msgs/msg/String",
        "diagnostic_msgs/msg/DiagnosticArray",
    }


def test_an_image_is_these_bytes() -> None:
    """Written by hand after the rules of CDR: aligned numbers, text with its length and a zero."""
    message = height_message(np.array([[1000, -2000]], np.float32), header_of(STAMP_NS, "ab"))
    text = b"\x06\0\0\0" + b"32FC1\0" + b"\0"
    expected = (
        b"\0\1\0\0"  # little-endian, first version of CDR
        + struct.pack("<iI", 1_700_000_000, 250_000_001)
        + struct.pack("<I3sx", 3, b"ab\0")
        + struct.pack("<II", 1, 2)
        + text
        + b"\0"  # step is aligned to four bytes
        + struct.pack("<I", 8)
        + struct.pack("<I2f", 8, 1.0, -2.0)
    )
    # is_bigendian, a byte, stands directly behind the text
    assert bytes(types().serialize_cdr(message.content, message.type)) == expected


def content(kind: str) -> Any:
    """Return a message of a type with something in each field."""
    head = header_of(STAMP_NS, "tactile_unit_7_optical")
    vectors = [make("geometry_msgs/msg/Vector3", x=0.1, y=-2.0, z=3.5) for _ in range(2)]
    pair = make("diagnostic_msgs/msg/KeyValue", key="value", value="29.9")
    status = make(
        "diagnostic_msgs/msg/DiagnosticStatus",
        level=1,
        name="tactile a: rate",
        message="too slow",
        hardware_id="a",
        values=[pair, pair],
    )
    field = make("sensor_msgs/msg/PointField", name="x", offset=0, datatype=7, count=1)
    data = np.arange(24, dtype=np.uint8)
    by_type = {
        "sensor_msgs/msg/Image": {
            "height": 2,
            "width": 4,
            "encoding": "bgr8",
            "is_bigendian": 0,
            "step": 12,
            "data": data,
        },
        "sensor_msgs/msg/PointCloud2": {
            "height": 1,
            "width": 2,
            "fields": [field, field, field],
            "is_bigendian": False,
            "point_step": 12,
            "row_step": 24,
            "data": data,
            "is_dense": True,
        },
        "geometry_msgs/msg/WrenchStamped": {
            "wrench": make("geometry_msgs/msg/Wrench", force=vectors[0], torque=vectors[1])
        },
        "diagnostic_msgs/msg/DiagnosticArray": {"status": [status, status]},
    }
    if kind in by_type:
        return make(kind, header=head, **by_type[kind])
    return make(kind, data=0.25 if kind.endswith("Float32") else "incipient")


@pytest.mark.parametrize("kind", sorted({kind.message for kind in KINDS}))
def test_the_dds_library_and_rosbags_write_the_same_bytes(kind: str) -> None:
    """Two implementations of CDR, each with its own idea of the type."""
    message = content(kind)
    of_rosbags = bytes(types().serialize_cdr(message, kind))
    read: IdlStruct = struct_type(kind).deserialize(of_rosbags)
    of_dds = read.serialize(use_version_2=False)
    assert of_dds == of_rosbags
    assert bytes(types().serialize_cdr(types().deserialize_cdr(of_dds, kind), kind)) == of_rosbags


def test_a_sample_travels_as_the_bytes_it_is_given_as() -> None:
    sample = sample_of("std_msgs/msg/Float32", b"\0\1\0\0\0\0\x80?")
    assert isinstance(sample, sample_type("std_msgs/msg/Float32"))
    assert sample.serialize(use_version_2=False) == sample.cdr
    assert sample_type("std_msgs/msg/Float32").deserialize(sample.cdr).cdr == sample.cdr
