"""Arming of cameras, and exclusive opening by serial number."""

from __future__ import annotations

import gc
from typing import Any

import pytest

from tactile_core.errors import CameraLost, DeviceBusy, DeviceError
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure
from tactile_core.quantities import Image


class Webcam(Camera):
    """A camera whose serial number can be unknown until it is open."""

    def __init__(self, serial: str = "", *, named: bool = True) -> None:
        super().__init__(Options())
        self._serial, self._named = serial, named
        self.opened = self.closed = 0

    @property
    def device_id(self) -> str:
        return self._serial if self._named or self.is_open else ""

    def _open(self) -> None:
        self.opened += 1

    def _close(self) -> None:
        self.closed += 1

    def _read(self, timeout_s: float) -> Image | None:
        raise CameraLost("gone")


PLAIN = Exposure({"left": 1.0}, ("left",))


def test_the_default_trigger_is_software() -> None:
    with Webcam() as camera:
        assert camera.arm([PLAIN, PLAIN]) is Trigger.SOFTWARE


@pytest.mark.parametrize("setting", [{"exposure_time_s": 0.01}, {"gain": 2.0}])
def test_a_camera_without_settings_rejects_exposure_and_gain(setting: dict[str, Any]) -> None:
    exposures = [PLAIN, Exposure({"right": 1.0}, ("right",), **setting)]
    with Webcam() as camera, pytest.raises(DeviceError, match="Webcam cannot change its exposure"):
        camera.arm(exposures)


def test_a_closed_camera_cannot_be_armed() -> None:
    with pytest.raises(DeviceError, match="closed"):
        Webcam().arm([PLAIN])


@pytest.mark.parametrize("named", [True, False], ids=["known before", "known when open"])
def test_opening_a_serial_twice_fails_and_the_first_stays_open(named: bool) -> None:
    with Webcam("0007") as first:
        second = Webcam("0007", named=named)
        with pytest.raises(DeviceBusy, match="'0007' is already open in this process, by another"):
            second.open()
        assert first.is_open
        assert not second.is_open
        assert second.opened == second.closed == (0 if named else 1)


def test_a_device_is_released_on_close_or_garbage_collection() -> None:
    first = Webcam("0007").open()
    first.open()
    first.close()
    with Webcam("0007"), Webcam("0008"):
        pass
    abandoned = Webcam("0009").open()
    del abandoned
    gc.collect()
    with Webcam("0009"):
        pass


def test_cameras_without_a_serial_can_be_open_together() -> None:
    with Webcam(), Webcam() as second:
        assert second.is_open
