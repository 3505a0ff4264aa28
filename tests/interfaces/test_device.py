"""Devices open and close reliably, even if their hardware fails."""

from __future__ import annotations

import pytest

from tactile_core.errors import CameraLost, DeviceBusy, DeviceError
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import Device, Options
from tactile_core.quantities import Image


class FakeDevice(Device):
    """Counts its open handles; can fail while it is being opened or closed."""

    def __init__(self, *, failure: BaseException | None = None, close_fails: bool = False) -> None:
        super().__init__(Options())
        self.failure = failure
        self.close_fails = close_fails
        self.handles = 0
        self.opened = 0
        self.closed = 0

    def _open(self) -> None:
        self.opened += 1
        self.handles += 1
        if self.failure is not None:
            raise self.failure

    def _close(self) -> None:
        self.closed += 1
        self.handles = 0
        if self.close_fails:
            raise RuntimeError("jammed")


class NoCamera(Camera):
    def _open(self) -> None:
        pass

    def _close(self) -> None:
        pass

    def _read(self, timeout_s: float) -> Image | None:
        raise CameraLost("gone")


def test_opening_twice_opens_once_and_returns_the_device() -> None:
    device = FakeDevice()
    assert device.open() is device
    assert device.open() is device
    assert (device.opened, device.is_open) == (1, True)


def test_an_error_within_the_block_is_not_hidden_by_one_of_closing() -> None:
    with pytest.raises(ValueError, match="mine") as raised, FakeDevice(close_fails=True).open():
        raise ValueError("mine")
    assert raised.value.__notes__ == ["closing failed as well: jammed"]


def test_closing_twice_closes_once() -> None:
    device = FakeDevice().open()
    device.close()
    device.close()
    assert (device.closed, device.is_open, device.handles) == (1, False, 0)


def test_closing_an_unopened_device_does_nothing() -> None:
    device = FakeDevice()
    device.close()
    assert device.closed == 0


def test_a_closed_device_opens_again() -> None:
    device = FakeDevice()
    for _ in range(3):
        with device:
            assert device.handles == 1
        assert device.handles == 0
    assert (device.opened, device.closed) == (3, 3)


@pytest.mark.parametrize("failure", [DeviceBusy("held by process 7"), KeyboardInterrupt()])
def test_a_failed_open_leaves_nothing_open(failure: BaseException) -> None:
    device = FakeDevice(failure=failure)
    with pytest.raises(type(failure)):
        device.open()
    assert (device.handles, device.closed, device.is_open) == (0, 1, False)


def test_a_device_can_be_opened_after_a_failure() -> None:
    device = FakeDevice(failure=DeviceBusy("held by process 7"))
    with pytest.raises(DeviceBusy):
        device.open()
    device.failure = None
    with device:
        assert device.handles == 1


def test_a_failing_close_does_not_hide_why_opening_failed() -> None:
    device = FakeDevice(failure=DeviceBusy("held by process 7"), close_fails=True)
    with pytest.raises(DeviceBusy, match="process 7") as caught:
        device.open()
    assert any("jammed" in note for note in caught.value.__notes__)
    assert not device.is_open


def test_a_device_is_closed_even_when_its_close_fails() -> None:
    device = FakeDevice(close_fails=True).open()
    with pytest.raises(RuntimeError, match="jammed"):
        device.close()
    assert not device.is_open
    device.close()


def test_an_error_in_the_block_closes_the_device_and_propagates() -> None:
    device = FakeDevice()
    with pytest.raises(ZeroDivisionError), device:
        raise ZeroDivisionError
    assert not device.is_open


def test_reading_a_closed_camera_explains_how_to_open_it() -> None:
    camera = NoCamera(Options())
    with pytest.raises(DeviceError, match=r"NoCamera is closed; open\(\) it"):
        camera.read()
    with camera, pytest.raises(CameraLost):
        camera.read()
    with pytest.raises(DeviceError, match="closed"):
        camera.read()
