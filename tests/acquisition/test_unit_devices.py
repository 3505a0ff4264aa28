"""The camera and the light box that a unit opens."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.desk import Desk

from tactile_core.acquisition.unit_devices import claim_device, forget_devices, with_unit_devices
from tactile_core.errors import InputError
from tactile_core.interfaces.device import ConnectedDevice
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile


@pytest.fixture
def desk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Desk:
    return Desk(monkeypatch, tmp_path)


@pytest.fixture(scope="module")
def finger() -> Profile:
    return load_profile("hex_fingertip")


@pytest.fixture(scope="module")
def portable() -> Profile:
    return load_profile("desktop_six_led_portable")


def test_a_unit_opens_the_camera_and_the_light_box_that_it_has_claimed(
    desk: Desk, portable: Profile
) -> None:
    desk.webcam("C310A001", "1-1")
    desk.webcam("C310A002", "1-2")
    desk.arduino("7543", "1-3")
    claim_device("S6", "C310A002")
    claim_device("S6", "1-3")
    mine = with_unit_devices(portable, "S6")
    assert mine.camera.options["serial"] == "C310A002"
    assert mine.camera.options["exposure_time_s"] == portable.camera.options["exposure_time_s"]
    assert mine.illumination.driver is not None
    assert mine.illumination.driver.options["port_path"] == "1-3"
    assert "usb_serial" not in mine.illumination.driver.options
    assert mine.illumination.options == portable.illumination.options


def test_a_claimed_camera_may_be_of_another_kind_than_the_profile_names(
    desk: Desk, finger: Profile
) -> None:
    desk.plug("core.uvc", ConnectedDevice("/dev/video0", "C270", "046d:0825", None, "1-1"))
    claim_device("F12", "1-1")
    options = with_unit_devices(finger, "F12").camera.options
    assert (options["usb_id"], options["port"]) == ("046d:0825", "1-1")


def test_one_serial_for_camera_and_lights_claims_both(desk: Desk, portable: Profile) -> None:
    desk.webcam("TWIN", "1-1.1")
    desk.arduino("TWIN", "1-1.2")
    assert [one.kind for one in claim_device("S6", "TWIN")] == ["camera", "light_driver"]


def test_without_a_claim_the_camera_with_the_serial_of_the_unit_is_taken(
    desk: Desk, finger: Profile
) -> None:
    desk.webcam("F12", "1-1")
    desk.webcam("F13", "1-2")
    assert with_unit_devices(finger, "F13").camera.options["serial"] == "F13"


def test_without_a_claim_the_camera_that_no_other_unit_has_is_taken(
    desk: Desk, finger: Profile
) -> None:
    desk.webcam("A", "1-1")
    desk.webcam("B", "1-2")
    claim_device("left", "A")
    assert with_unit_devices(finger, "right").camera.options["serial"] == "B"


def test_two_of_a_kind_with_nothing_to_choose_by_are_left_to_the_camera(
    desk: Desk, finger: Profile
) -> None:
    desk.webcam(None, "1-1")
    desk.webcam(None, "1-2")
    assert with_unit_devices(finger, "F12").camera == finger.camera


def test_the_camera_of_another_unit_is_refused(desk: Desk, finger: Profile) -> None:
    desk.webcam("A", "1-1")
    claim_device("left", "A")
    with pytest.raises(InputError, match=r"'right' is not connected: .*serial A.* to 'left'; conn"):
        with_unit_devices(finger, "right")


def test_a_virtual_sensor_and_a_recording_have_no_devices(desk: Desk) -> None:
    desk.webcam("A", "1-1")
    claim_device("F12", "A")
    virtual = load_profile("hex_fingertip", sim=True)
    assert with_unit_devices(virtual, "F12") is virtual


def test_a_device_taken_by_another_unit_and_a_forgotten_one_are_free(
    desk: Desk, finger: Profile
) -> None:
    desk.webcam("A", "1-1")
    claim_device("left", "A")
    (taken,) = claim_device("right", "A")
    assert taken.unit == "left"
    assert forget_devices("right")["camera"].serial == "A"
    with pytest.raises(InputError, match=r"'right' has claimed no device; .* none"):
        forget_devices("right")


@pytest.mark.parametrize(
    ("unit", "device", "message"),
    [
        (
            "F12",
            "C310A009",
            r"no connected camera .* 'C310A009'; connected are: .*HD Webcam C310 \(",
        ),
        (
            "F12",
            "SAME",
            r"'SAME' names several devices: .*port 1-1.*port 1-2.*; name one by its po",
        ),
        ("F/12", "SAME", r"serial 'F/12': use only letters"),
        ("F12", "192.168.0.7", r"Basler.* neither a serial number nor a USB port"),
    ],
)
def test_a_claim_that_cannot_be_made_is_refused(
    desk: Desk, unit: str, device: str, message: str
) -> None:
    desk.webcam("SAME", "1-1")
    desk.webcam("SAME", "1-2")
    desk.plug("genicam.camera", ConnectedDevice("192.168.0.7", "Basler acA2440"))
    with pytest.raises(InputError, match=message):
        claim_device(unit, device)
    assert not desk.claims.exists()


def test_one_of_two_cameras_with_the_same_serial_is_claimed_by_its_port(
    desk: Desk, finger: Profile
) -> None:
    desk.webcam("SAME", "1-1")
    desk.webcam("SAME", "1-2")
    claim_device("F12", "1-2")
    options = with_unit_devices(finger, "F12").camera.options
    assert (options.get("serial"), options["port"]) == (None, "1-2")


def test_a_claim_that_the_camera_cannot_use_says_what_to_do(desk: Desk) -> None:
    desk.webcam(None, "1-2")
    claim_device("F12", "1-2")
    with pytest.raises(InputError, match=r"genicam\.camera cannot choose .* port; .*--forget F12"):
        with_unit_devices(load_profile("desktop_three_colour"), "F12")
