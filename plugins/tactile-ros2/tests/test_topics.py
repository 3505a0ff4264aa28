"""What the messages of a reading say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.readings import SHAPE, contact, height, slopes

from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.health import Finding, Health
from tactile_core.quantities import Frame, HeightMap, Quantity, SlipState, Wrench
from tactile_ros2.topics import (
    KINDS,
    bgr_of,
    diagnostics_message,
    messages_of,
    missing_note,
    topics_of,
)
from tactile_rosbag.names import SensorNames

NAMES = SensorNames.of_unit("unit-7", "hex_fingertip")
ALL = {kind.name for kind in KINDS}
STAMP_NS = 1_700_000_000_250_000_001


def frame(pixels: np.ndarray[Any, Any], full_scale: float = 255) -> Frame:
    channels = tuple(f"light_{number}" for number in range(pixels.shape[2]))
    return Frame(pixels, channels, 0.1, full_scale)


def sent(*quantities: Quantity, wanted: set[str] = ALL) -> dict[str, Any]:
    """Return the contents of a reading's messages by topic."""
    shown = frame(np.arange(np.prod((*SHAPE, 3)), dtype=np.uint8).reshape(*SHAPE, 3))
    one = Reading(shown, {type(q): q for q in quantities}, {})
    return {name: m.content for name, m in messages_of(one, STAMP_NS, NAMES, wanted)}


def test_all_stamped_messages_have_the_time_of_exposure_and_the_optical_frame() -> None:
    found = sent(height(), Wrench(1, 2, 3, 4))
    assert set(found) == {"image_raw", "height", "points", "wrench"}
    for message in found.values():
        stamp = message.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == STAMP_NS
        assert message.header.frame_id == "tactile_unit_7_optical"


def test_the_picture_is_blue_green_red() -> None:
    image = sent()["image_raw"]
    assert (image.encoding, image.height, image.width, image.step) == ("bgr8", *SHAPE, 24)
    assert image.data[:6].tolist() == [2, 1, 0, 5, 4, 3]


def test_lights_that_are_no_colours_are_a_grey_picture() -> None:
    six = np.stack([np.full(SHAPE, 10 * n, np.uint16) for n in range(6)], axis=2)
    picture = bgr_of(frame(six, full_scale=510))
    assert picture.shape == (*SHAPE, 3)
    assert set(picture.ravel().tolist()) == {round(25 / 2)}


def test_heights_are_metres_and_points_lie_below_the_rest_surface() -> None:
    pressed = height(0.5)
    found = sent(pressed)
    np.testing.assert_array_equal(
        found["height"].data.view("<f4").reshape(SHAPE), np.float32(pressed.mm * 1e-3)
    )
    points = found["points"].data.view("<f4").reshape(*SHAPE, 3)
    # z points away from the camera (REP 103, optical frame), and a press is towards it
    np.testing.assert_allclose(points[..., 2], -0.5e-3, rtol=1e-6)
    assert points[0, -1, 0] > 0 > points[0, 0, 0]
    assert points[-1, 0, 1] > 0 > points[0, 0, 1]


def test_a_press_is_a_force_towards_the_camera() -> None:
    wrench = sent(Wrench(fx_n=0.5, fy_n=-0.25, fz_n=2.0, tz_nmm=3.0))["wrench"].wrench
    assert (wrench.force.x, wrench.force.y, wrench.force.z) == (0.5, -0.25, -2.0)
    assert (wrench.torque.x, wrench.torque.y, wrench.torque.z) == pytest.approx((0, 0, 0.003))


def test_slip_is_a_degree_and_a_word() -> None:
    found = sent(SlipState("incipient", 0.25))
    assert (found["slip_degree"].data, found["slip_state"].data) == (0.25, "incipient")


def test_nothing_is_made_that_nobody_listens_to() -> None:
    assert set(sent(height(), slopes(), SlipState("slip", 1.0), wanted={"height"})) == {"height"}


def test_topics_without_a_measurement_are_left_out_with_a_note() -> None:
    gives = (type(slopes()), type(contact()), SlipState)
    names = [kind.name for kind in topics_of(gives)]
    assert names == ["image_raw", "slip_degree", "slip_state", "diagnostics"]
    assert missing_note(gives) == (
        "not measured: height, force; so these topics are left out: height, points, wrench"
    )
    assert missing_note((HeightMap, Wrench, SlipState)) == ""


def test_diagnostics_say_what_is_wrong_and_leave_out_what_is_unknown() -> None:
    fine, unknown = Finding(30.0, 30.0, "Hz"), Finding.unknown("no step tracks markers")
    slow = Finding.from_value(90.0, 40.0, "ms", "it takes too long")
    health = Health(fine, slow, fine, fine, fine, unknown, {"red": fine}, fine, unknown)
    warned = ["the lens is dirty", "it takes too long"]
    array = diagnostics_message(health, warned, STAMP_NS, NAMES, "unit-7").content
    by_name = {status.name: status for status in array.status}
    whole = by_name["tactile unit-7: sensor"]
    assert (whole.level, whole.message) == (1, "it takes too long; the lens is dirty")
    rate, latency = by_name["tactile unit-7: rate"], by_name["tactile unit-7: latency"]
    assert (rate.level, rate.message, latency.level) == (0, "ok", 1)
    assert {one.key: one.value for one in rate.values} == {
        "value": "30.0",
        "expected": "30.0",
        "unit": "Hz",
    }
    assert "tactile unit-7: light red" in by_name
    assert "tactile unit-7: markers" not in by_name
    assert {status.hardware_id for status in array.status} == {"unit-7"}
