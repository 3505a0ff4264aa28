"""``tactile devices``: what is connected, by unit."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.desk import Desk

from tactile_core.cli import main
from tactile_core.interfaces.device import ConnectedDevice


@pytest.fixture
def desk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Desk:
    return Desk(monkeypatch, tmp_path)


def run(capsys: pytest.CaptureFixture[str], *options: str) -> tuple[object, str, str]:
    with pytest.raises(SystemExit) as caught:
        main(["devices", *options])
    return caught.value.code, *capsys.readouterr()


def test_without_devices_the_list_is_empty(desk: Desk, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys) == (0, "", "no camera and no light box is connected\n")
    assert run(capsys, "--json") == (0, '{"devices": [], "claims": []}\n', "")


def test_each_device_has_its_profiles_its_unit_and_who_holds_it(
    desk: Desk, capsys: pytest.CaptureFixture[str]
) -> None:
    desk.webcam("C310A001", "1-2.4", held_by=("cheese (process 12)",))
    desk.arduino(None, "1-3")
    code, out, err = run(capsys, "--claim", "F12=C310A001")
    assert code == 0
    assert err == "HD Webcam C310 (serial C310A001, port 1-2.4) is the camera of F12\n"
    header, webcam, arduino = out.splitlines()
    assert header.split()[:4] == ["id", "port", "serial", "product"]
    assert webcam.startswith("046d:081b  1-2.4  C310A001")
    assert "F12  cheese (process 12)" in webcam
    assert "hex_fingertip" in webcam
    assert "desktop_six_led" not in webcam.replace("desktop_six_led_portable", "")
    assert "desktop_six_led, desktop_six_led_portable" in arduino
    found = json.loads(run(capsys, "--json")[1])
    entry = found["devices"][0]
    assert "hex_fingertip" in entry.pop("profiles")
    assert entry == {
        "usb_id": "046d:081b",
        "vendor_id": 0x046D,
        "product_id": 0x081B,
        "product": "HD Webcam C310",
        "serial": "C310A001",
        "port_path": "1-2.4",
        "kind": "camera",
        "use": "core.uvc",
        "place": "/dev/video0",
        "held_by": ["cheese (process 12)"],
        "unit": "F12",
    }
    assert found["claims"] == [
        {
            "unit": "F12",
            "kind": "camera",
            "usb_id": "046d:081b",
            "serial": "C310A001",
            "port_path": None,
            "product": "HD Webcam C310",
            "connected": True,
        }
    ]


@pytest.mark.parametrize(
    ("product", "usb_id", "serial", "profile"),
    [
        ("GelSight Mini R0B 2BNN-4ZE7", "0c45:636d", "2BNN4ZE7", "gelsight_mini"),
        ("DIGIT", "2833:0209", "D20123", "digit"),
    ],
)
def test_a_sensor_of_a_shop_is_listed_with_model_serial_and_profile(
    desk: Desk,
    capsys: pytest.CaptureFixture[str],
    product: str,
    usb_id: str,
    serial: str,
    profile: str,
) -> None:
    desk.plug("core.uvc", ConnectedDevice("/dev/video0", product, usb_id, serial, "1-1"))
    # webcams share the id of a GelSight Mini
    desk.plug("core.uvc", ConnectedDevice("/dev/video2", "USB 2.0 Camera", "0c45:636d", "", "1-2"))
    _, line, other = run(capsys)[1].splitlines()
    assert line.split()[:3] == [usb_id, "1-1", serial]
    assert profile in line.split(product)[1]
    assert profile not in other


def test_a_camera_on_the_network_has_no_usb_id(
    desk: Desk, capsys: pytest.CaptureFixture[str]
) -> None:
    desk.plug("genicam.camera", ConnectedDevice("192.168.0.7", "Basler acA2440", serial="40012345"))
    (entry,) = json.loads(run(capsys, "--json")[1])["devices"]
    assert (entry["usb_id"], entry["vendor_id"], entry["place"]) == (None, None, "192.168.0.7")
    assert entry["profiles"] == ["desktop_six_led", "desktop_three_colour"]


def test_what_can_be_listed_is_listed_and_the_rest_is_said_once(
    desk: Desk, capsys: pytest.CaptureFixture[str]
) -> None:
    desk.webcam("C310A001", "1-2.4")
    desk.missing = dict.fromkeys(("core.uvc", "genicam.camera"), "no libusb; install it")
    code, out, err = run(capsys)
    assert code == 0
    assert "C310A001" in out
    assert err == "note: no libusb; install it\n"


def test_a_claimed_device_that_is_absent_is_listed_until_it_is_forgotten(
    desk: Desk, capsys: pytest.CaptureFixture[str]
) -> None:
    desk.webcam(None, "1-2")
    run(capsys, "--claim", "F12=1-2")
    desk.devices["core.uvc"].clear()
    assert run(capsys)[1] == "not connected: HD Webcam C310 (port 1-2), the camera of F12\n"
    _, out, err = run(capsys, "--forget", "F12")
    assert out == ""
    assert err.startswith("HD Webcam C310 (port 1-2) is no longer the camera of F12\n")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--claim", "F12"), "--claim F12: write SERIAL=DEVICE, for example"),
        (("--claim", "F12=nothing"), "no connected camera or light box"),
        (("--forget", "F12"), "the unit 'F12' has claimed no device"),
        (("--forget", "F12", "--claim", "F12=x"), "exclude each other"),
    ],
)
def test_bad_input_is_one_sentence(
    desk: Desk, capsys: pytest.CaptureFixture[str], options: tuple[str, ...], message: str
) -> None:
    code, out, err = run(capsys, *options)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("command", ["run", "doctor"])
def test_the_camera_of_another_unit_is_not_opened(
    desk: Desk, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    desk.webcam("A", "1-1")
    run(capsys, "--claim", "left=A")
    with pytest.raises(SystemExit) as caught:
        main([command, "hex_fingertip", "--serial", "right"])
    assert caught.value.code == 2
    assert "the camera of the unit 'right' is not connected" in capsys.readouterr().err


def test_a_damaged_list_of_claims_is_one_sentence(
    desk: Desk, capsys: pytest.CaptureFixture[str]
) -> None:
    desk.claims.parent.mkdir(parents=True)
    desk.claims.write_text("{")
    code, out, err = run(capsys)
    assert (code, out) == (2, "")
    assert "claims.json is no list of claims" in err
