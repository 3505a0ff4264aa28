"""``tactile run`` without the devices that the profile names: one sentence that says what to do."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.sysfs import Sysfs

from tactile_core.builtin.cameras.uvc_camera import UvcCamera
from tactile_core.cli import main

ANOTHER = "connect that camera or correct 'camera' in the profile"


@pytest.fixture
def sysfs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Sysfs:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setattr(UvcCamera, "sysfs", tmp_path / "sys")
    monkeypatch.setattr("sys.platform", "linux")
    return Sysfs(tmp_path / "sys")


def refusal(capsys: pytest.CaptureFixture[str], *words: str | Path) -> tuple[object, str]:
    with pytest.raises(SystemExit) as caught:
        main(["run", *map(str, words)])
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return caught.value.code, err


def profile(folder: Path, parent: str, changes: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(f"extends: {parent}\nname: mine\n{changes}\n")
    return path


def test_nothing_connected(sysfs: Sysfs, capsys: pytest.CaptureFixture[str]) -> None:
    code, message = refusal(capsys, "hex_fingertip")
    assert code == 1
    assert "no USB camera is connected (wanted: usb_id 046d:081b); connect it" in message
    assert "a recording with --input, or the virtual sensor with --sim" in message


def test_another_camera_connected(sysfs: Sysfs, capsys: pytest.CaptureFixture[str]) -> None:
    sysfs.plug("1-1", "0c45:636d", "USB Camera", "A1")
    code, message = refusal(capsys, "hex_fingertip")
    assert code == 1
    assert (
        "no connected camera has usb_id 046d:081b; connected are 0c45:636d 'USB Camera'" in message
    )
    assert "(serial A1, port 1-1)" in message
    assert ANOTHER in message
    assert "tactile devices --claim SERIAL=DEVICE" in message


def test_the_serial_of_another_camera(
    sysfs: Sysfs, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sysfs.plug("1-1", serial="A1")
    mine = profile(tmp_path, "hex_fingertip", "camera: {serial: B2}")
    code, message = refusal(capsys, mine)
    assert code == 1
    assert "no connected camera has serial B2; connected are" in message
    assert ANOTHER in message


def test_a_unit_that_has_claimed_nothing_among_two(
    sysfs: Sysfs, capsys: pytest.CaptureFixture[str]
) -> None:
    sysfs.plug("1-1")
    sysfs.plug("1-2")
    code, message = refusal(capsys, "hex_fingertip", "--serial", "left")
    assert code == 1
    assert "2 cameras match usb_id 046d:081b" in message
    assert "(no serial, port 1-1)" in message
    assert "write 'port' in 'camera' of the profile to choose one, or remember which" in message


def test_a_serial_port_that_does_not_exist(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("serial", reason="'pip install pyserial' tests core.serial_leds")
    mine = profile(tmp_path, "desktop_six_led", "illumination: {driver: {port: /dev/ttyNOWHERE}}")
    code, message = refusal(capsys, mine)
    assert code == 1
    assert "there is no serial port /dev/ttyNOWHERE; plug the light box in, or correct" in message


def test_a_light_driver_and_no_camera_to_pair(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = profile(tmp_path, "desktop_six_led", "camera: {use: core.replay}")
    code, message = refusal(capsys, mine)
    assert code == 2
    assert "the profile has a light driver, but core.replay is no camera that its lights" in message
