"""Bags, read back with the reader of ``rosbags``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from support.readings import SHAPE, contact, height, markers, slopes

from tactile_core.errors import InputError
from tactile_core.formats.yaml_tree import read_mapping
from tactile_core.interfaces.sink import Reading, Session
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, HeightMap, Image, Quantity, SlipState
from tactile_core.quantities.fields import FieldSpec
from tactile_core.recordings.output_folder import OutputFolder
from tactile_rosbag.bag import Bag, BagOptions
from tactile_rosbag.messages import types
from tactile_rosbag.names import ros_name
from tactile_rosbag.si_units import si_unit

WALL_S = 1_700_000_000.25


@dataclass(frozen=True, eq=False)
class Load(Quantity):
    """Of somebody's plugin."""

    fx: Annotated[float, FieldSpec("N")]
    fy: Annotated[float, FieldSpec("N")]
    fz: Annotated[float, FieldSpec("N")]
    tz: Annotated[float, FieldSpec("N·mm")]


def reading(*quantities: Quantity, image: Image | None = None) -> Reading:
    frame = Frame(
        np.arange(np.prod((*SHAPE, 3)), dtype=np.uint8).reshape(*SHAPE, 3),
        ("r", "g", "b"),
        0.1,
        wall_time_s=WALL_S,
        raw=() if image is None else (image,),
    )
    return Reading(frame, {type(q): q for q in quantities}, {})


def bagged(
    folder: Path, *readings: Reading, serial: str | None = "unit-7", **options: Any
) -> tuple[dict[str, list[Any]], dict[str, str]]:
    """Write readings; return the messages by topic, and the units."""
    sink = Bag(BagOptions(**options))
    build = load_profile("hex_fingertip")
    sink.open(Session(build, serial, ("r", "g", "b"), (), OutputFolder(folder)))
    for one in readings:
        sink.write(one)
    sink.close()
    (bag,) = folder.glob("*.rosbag")
    found: dict[str, list[Any]] = {}
    with Reader(bag) as reader:
        for connection, stamp_ns, data in reader.messages():
            message = types().deserialize_cdr(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((stamp_ns, message))
    described = read_mapping(bag / "metadata.yaml")["rosbag2_bagfile_information"]
    return found, json.loads(described["custom_data"]["units"])


def test_heights_are_float_images_and_points_in_metres(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    tall = HeightMap(rng.normal(size=SHAPE).astype(np.float32), np.ones(SHAPE, bool), 0.1)
    found, units = bagged(tmp_path, reading(tall))
    ((stamp_ns, image),) = found["/tactile/unit_7/height"]
    assert stamp_ns == 1_700_000_000_250_000_000
    assert image.header.stamp.sec + 1e-9 * image.header.stamp.nanosec == WALL_S
    assert image.header.frame_id == "tactile_unit_7_optical"
    assert (image.encoding, image.height, image.width, image.step) == ("32FC1", *SHAPE, 32)
    metres = image.data.view("<f4").reshape(SHAPE)
    np.testing.assert_allclose(metres, tall.mm * 1e-3, rtol=1e-6)
    ((_, cloud),) = found["/tactile/unit_7/points"]
    points = cloud.data.view("<f4").reshape(*SHAPE, 3)
    np.testing.assert_allclose(points, tall.points_mm * 1e-3, rtol=1e-6)
    assert [field.name for field in cloud.fields] == ["x", "y", "z"]
    assert {units["/tactile/unit_7/height"], units["/tactile/unit_7/points"]} == {"m"}


def test_a_jpeg_stays_the_camera_s_own_bytes(tmp_path: Path) -> None:
    pixels = np.full((16, 16, 3), 90, np.uint8)
    jpeg = cv2.imencode(".jpg", pixels)[1].tobytes()
    found, _ = bagged(tmp_path, reading(image=Image(pixels, encoded=jpeg)))
    ((_, image),) = found["/tactile/unit_7/camera/compressed"]
    assert image.data.tobytes() == jpeg
    assert image.format == "jpeg"


@pytest.mark.parametrize(
    ("pixels", "encoding"),
    [
        (np.arange(12, dtype=np.uint8).reshape(2, 2, 3), "rgb8"),
        (np.arange(4, dtype=np.uint16).reshape(2, 2), "mono16"),
    ],
)
def test_pixels_stay_as_the_camera_sent_them(tmp_path: Path, pixels: Any, encoding: str) -> None:
    found, _ = bagged(tmp_path, reading(image=Image(pixels)))
    ((_, image),) = found["/tactile/unit_7/camera/image_raw"]
    assert image.encoding == encoding
    np.testing.assert_array_equal(image.data.view(pixels.dtype).reshape(pixels.shape), pixels)


def test_forces_of_any_quantity_are_a_wrench_on_the_sensor(tmp_path: Path) -> None:
    found, units = bagged(tmp_path, reading(Load(0.5, -0.25, 2.0, 3.0)))
    ((_, stamped),) = found["/tactile/unit_7/wrench"]
    force, torque = stamped.wrench.force, stamped.wrench.torque
    assert (force.x, force.y, force.z) == (0.5, -0.25, -2.0)
    assert (torque.x, torque.y, torque.z) == pytest.approx((0, 0, 0.003))
    ((_, fz),) = found["/tactile/unit_7/load/fz"]
    assert (fz.data, units["/tactile/unit_7/load/fz"]) == (2.0, "N")


def test_every_field_has_a_topic_in_si_units(tmp_path: Path) -> None:
    slip = SlipState("incipient", 0.25, rotation_deg=90.0)
    tracked, sloped = markers(), slopes()
    found, units = bagged(tmp_path, reading(tracked, sloped, contact(), slip))
    one = {topic.removeprefix("/tactile/unit_7/"): m[0][1] for topic, m in found.items()}
    np.testing.assert_array_equal(one["gradients/x"].data.view("<f4").reshape(SHAPE), sloped.x)
    px = one["marker_field/px"]
    np.testing.assert_array_equal(px.data, tracked.px.reshape(-1))
    assert [(d.label, d.size) for d in px.layout.dim] == [("marker", 2), ("xy", 2)]
    assert one["slip_state/state"].data == "incipient"
    assert one["slip_state/rotation_deg"].data == pytest.approx(np.pi / 2)
    assert units["/tactile/unit_7/slip_state/rotation_deg"] == "rad"
    assert set(one["contact_mask/mask"].data) == {255}
    assert "slip_state/onset_s" not in one
    assert one["image/image_raw"].encoding == "rgb8"


def test_options_leave_out_what_is_large(tmp_path: Path) -> None:
    found, _ = bagged(tmp_path, reading(height(), slopes()), points=False, fields=False)
    assert set(found) == {"/tactile/unit_7/height", "/tactile/unit_7/image/image_raw"}


def test_a_bag_is_never_overwritten(tmp_path: Path) -> None:
    bagged(tmp_path, reading())
    with pytest.raises(InputError, match="already exists; move it away"):
        bagged(tmp_path, reading())


@pytest.mark.parametrize(
    ("serial", "name"), [("0007", "sensor_0007"), ("a-b.c", "a_b_c"), ("_x", "sensor__x")]
)
def test_a_serial_becomes_a_valid_ros_name(serial: str, name: str) -> None:
    assert ros_name(serial) == name


def test_without_a_serial_the_topics_have_the_profile_s_name(tmp_path: Path) -> None:
    found, _ = bagged(tmp_path, reading(), serial=None)
    assert set(found) == {"/tactile/hex_fingertip/image/image_raw"}


def test_a_unit_that_is_not_known_stays() -> None:
    assert si_unit("lux") == ("lux", 1.0)
