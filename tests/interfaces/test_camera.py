"""A camera is armed before it is read, and a device is opened once."""

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
    """A camera with a serial number, which it may know only when it is open."""

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


def test_a_plain_camera_leaves_the_lights_to_the_software() -> None:
    with Webcam() as camera:
        assert camera.arm([PLAIN, PLAIN]) is Trigger.SOFTWARE


@pytest.mark.parametrize("wish", [{"exposure_time_s": 0.01}, {"gain": 2.0}])
def test_a_plain_camera_refuses_what_it_would_not_do(wish: dict[str, Any]) -> None:
    exposures = [PLAIN, Exposure({"right": 1.0}, ("right",), **wish)]
    with Webcam() as camera, pytest.raises(DeviceError, match="Webcam cannot change its exposure"):
        camera.arm(exposures)


def test_a_closed_camera_is_not_armed() -> None:
    with pytest.raises(DeviceError, match="closed"):
        Webcam().arm([PLAIN])


@pytest.mark.parametrize("named", [True, False], ids=["known before", "known when open"])
def test_two_cameras_of_one_serial_are_refused_and_the_first_stays_open(named: bool) -> None:
    with Webcam("0007") as first:
        second = Webcam("0007", named=named)
        with pytest.raises(DeviceBusy, match="'0007' is already open in this process, by another"):
            second.open()
        assert first.is_open
        assert not second.is_open
        assert second.opened == second.closed == (0 if named else 1)


def test_a_device_is_free_again_when_its_camera_is_closed_or_forgotten() -> None:
    first = Webcam("0007").open()
    first.open()
    first.close()
    with Webcam("0007"), Webcam("0008"):
        pass
    forgotten = Webcam("0009").open()
    del forgotten
    gc.collect()
    with Webcam("0009"):
        pass


def test_cameras_that_cannot_be_named_apart_are_not_refused() -> None:
    with Webcam(), Webcam() as second:
        assert second.is_open
