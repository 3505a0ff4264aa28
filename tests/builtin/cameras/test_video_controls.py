"""Locking the settings of a camera that may refuse, clamp or lack them."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.builtin.cameras.video_controls import (
    AUTO_FOCUS,
    AUTO_GAIN,
    AUTO_WHITE_BALANCE,
    EXPOSURE,
    EXPOSURE_MODE,
    FOCUS,
    GAIN,
    RATE_MAY_CHANGE,
    WHITE_BALANCE,
    ControlRange,
    lock,
    opened_for_controls,
    set_named,
)
from tactile_core.errors import DeviceError, DeviceForbidden


class Webcam:
    """Controls that clamp like those of a UVC camera, and refuse while they are automatic."""

    automatic_of = {EXPOSURE: EXPOSURE_MODE, WHITE_BALANCE: AUTO_WHITE_BALANCE}  # noqa: RUF012

    def __init__(self) -> None:
        self.ranges = {
            EXPOSURE_MODE: ControlRange(0, 3, 1),
            EXPOSURE: ControlRange(1, 10_000, 1),
            GAIN: ControlRange(0, 255, 1),
            WHITE_BALANCE: ControlRange(2800, 6500, 10),
            AUTO_WHITE_BALANCE: ControlRange(0, 1, 1),
            RATE_MAY_CHANGE: ControlRange(0, 1, 1),
        }
        self.values = {
            EXPOSURE_MODE: 3,
            EXPOSURE: 156,
            GAIN: 64,
            WHITE_BALANCE: 4000,
            AUTO_WHITE_BALANCE: 1,
            RATE_MAY_CHANGE: 1,
        }

    def range_of(self, control: int) -> ControlRange | None:
        return self.ranges.get(control)

    def get(self, control: int) -> int:
        return self.values[control]

    def set(self, control: int, value: int) -> None:
        automatic = self.automatic_of.get(control)
        if automatic is not None and self.values[automatic] != (automatic == EXPOSURE_MODE):
            raise OSError(errno.EACCES, "it is automatic")
        takes = self.ranges[control]
        clamped = min(max(value, takes.lowest), takes.highest)
        self.values[control] = clamped // takes.step * takes.step


@given(
    st.floats(1e-4, 1.0), st.integers(0, 255), st.floats(2800, 6500), st.sampled_from([True, False])
)
def test_settings_within_the_range_are_locked_and_reported(
    exposure_time_s: float, gain: int, white_balance_k: float, fixed_rate: bool
) -> None:
    camera = Webcam()
    if not fixed_rate:
        del camera.ranges[RATE_MAY_CHANGE]
    locked = lock(
        camera,
        "the camera",
        exposure_time_s=exposure_time_s,
        gain=gain,
        white_balance_k=white_balance_k,
    )
    assert locked.exposure_time_s == pytest.approx(exposure_time_s, abs=0.5001e-4)
    assert locked.gain == gain
    assert camera.values[WHITE_BALANCE] == pytest.approx(white_balance_k, abs=10)
    assert camera.values[EXPOSURE_MODE] == 1
    assert camera.values[AUTO_WHITE_BALANCE] == 0
    assert locked.notes == ()
    if fixed_rate:
        assert camera.values[RATE_MAY_CHANGE] == 0


def test_a_value_that_the_camera_changes_is_an_error_with_what_it_takes() -> None:
    message = r"the camera chose exposure_time_s: 1 instead of 2; it takes 0.0001 to 1, so correct"
    with pytest.raises(DeviceError, match=message):
        lock(Webcam(), "the camera", exposure_time_s=2.0)


def test_a_setting_that_the_camera_lacks_is_an_error() -> None:
    with pytest.raises(DeviceError, match=r"has no control for focus; remove 'camera\.focus'"):
        lock(Webcam(), "the camera", focus=10)


def test_a_setting_that_the_camera_refuses_is_an_error() -> None:
    camera = Webcam()
    del camera.ranges[EXPOSURE_MODE]  # stays automatic
    with pytest.raises(DeviceError, match=r"refuses exposure_time_s: 0.01 \(it is automatic\)"):
        lock(camera, "the camera", exposure_time_s=0.01)


def test_what_stays_automatic_is_noted_and_not_reported_as_known() -> None:
    camera = Webcam()
    camera.ranges |= {AUTO_FOCUS: ControlRange(0, 1, 1), AUTO_GAIN: ControlRange(0, 1, 1)}
    camera.values |= {AUTO_FOCUS: 1, AUTO_GAIN: 0, FOCUS: 3}
    before = camera.values[EXPOSURE]
    locked = lock(camera, "the camera")
    assert locked.exposure_time_s is None
    assert camera.values[EXPOSURE] == before
    assert [note.split("'")[1] for note in locked.notes] == [
        "camera.exposure_time_s",
        "camera.white_balance_k",
        "camera.focus",
    ]


def test_a_camera_without_any_control_is_used_as_it_is() -> None:
    class Plain(Webcam):
        def range_of(self, control: int) -> ControlRange | None:
            return None

    locked = lock(Plain(), "the camera")
    assert (locked.exposure_time_s, locked.gain, locked.notes) == (None, None, ())


def test_a_device_file_that_is_absent_is_explained(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="does not exist, although the kernel lists the camera"):
        opened_for_controls(str(tmp_path / "video0"))


def test_a_control_is_set_by_name_and_read_back() -> None:
    camera = Webcam()
    assert set_named(camera, "the camera", "gain", 12) == 12
    assert set_named(camera, "the camera", "gain", 4095) == 255


def test_a_control_that_is_unknown_missing_or_refused_is_named() -> None:
    camera = Webcam()
    with pytest.raises(DeviceError, match=r"no control 'shine'; the controls are brightness"):
        set_named(camera, "the camera", "shine", 1)
    with pytest.raises(DeviceError, match="the camera has no control 'zoom'"):
        set_named(camera, "the camera", "zoom", 1)
    with pytest.raises(DeviceError, match=r"refuses white_balance 3000 .* 2800 to 6500"):
        set_named(camera, "the camera", "white_balance", 3000)


def test_a_device_file_without_permission_names_the_udev_rules(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError

    monkeypatch.setattr("os.open", refuse)
    with pytest.raises(DeviceForbidden, match=r"60-tactile.rules /etc/udev/rules.d/ && sudo udev"):
        opened_for_controls(str(tmp_path / "video0"))
