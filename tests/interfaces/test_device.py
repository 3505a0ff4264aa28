"""Devices open and close like a light switch, whatever their hardware does."""

from __future__ import annotations

import pytest

from tactile_core.errors import CameraLost, DeviceBusy, DeviceError
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import Device, Options
from tactile_core.quantities import Image


class Drawer(Device):
    """Counts what it holds; may fail half-way through opening."""

    def __init__(self, *, failure: BaseException | None = None, close_fails: bool = False) -> None:
        super().__init__(Options())
        self.failure = failure
        self.close_fails = close_fails
        self.held = 0
        self.opened = 0
        self.closed = 0

    def _open(self) -> None:
        self.opened += 1
        self.held += 1
        if self.failure is not None:
            raise self.failure

    def _close(self) -> None:
        self.closed += 1
        self.held = 0
        if self.close_fails:
            raise RuntimeError("jammed")


class NoCamera(Camera):
    def _open(self) -> None:
        pass

    def _close(self) -> None:
        pass

    def _read(self, timeout_s: float) -> Image | None:
        raise CameraLost("gone")


def test_opening_twice_opens_once_and_gives_the_device() -> None:
    drawer = Drawer()
    assert drawer.open() is drawer
    assert drawer.open() is drawer
    assert (drawer.opened, drawer.is_open) == (1, True)


def test_closing_twice_closes_once() -> None:
    drawer = Drawer().open()
    drawer.close()
    drawer.close()
    assert (drawer.closed, drawer.is_open, drawer.held) == (1, False, 0)


def test_closing_what_was_never_open_does_nothing() -> None:
    drawer = Drawer()
    drawer.close()
    assert drawer.closed == 0


def test_a_closed_device_opens_again() -> None:
    drawer = Drawer()
    for _ in range(3):
        with drawer:
            assert drawer.held == 1
        assert drawer.held == 0
    assert (drawer.opened, drawer.closed) == (3, 3)


@pytest.mark.parametrize("failure", [DeviceBusy("held by process 7"), KeyboardInterrupt()])
def test_a_failed_open_leaves_nothing_open(failure: BaseException) -> None:
    drawer = Drawer(failure=failure)
    with pytest.raises(type(failure)):
        drawer.open()
    assert (drawer.held, drawer.closed, drawer.is_open) == (0, 1, False)


def test_a_device_that_failed_to_open_opens_once_the_cause_is_gone() -> None:
    drawer = Drawer(failure=DeviceBusy("held by process 7"))
    with pytest.raises(DeviceBusy):
        drawer.open()
    drawer.failure = None
    with drawer:
        assert drawer.held == 1


def test_why_opening_failed_is_not_hidden_by_a_close_that_fails_too() -> None:
    drawer = Drawer(failure=DeviceBusy("held by process 7"), close_fails=True)
    with pytest.raises(DeviceBusy, match="process 7") as caught:
        drawer.open()
    assert any("jammed" in note for note in caught.value.__notes__)
    assert not drawer.is_open


def test_a_device_is_closed_even_when_its_close_fails() -> None:
    drawer = Drawer(close_fails=True).open()
    with pytest.raises(RuntimeError, match="jammed"):
        drawer.close()
    assert not drawer.is_open
    drawer.close()


def test_leaving_the_block_by_an_error_closes_and_lets_the_error_through() -> None:
    drawer = Drawer()
    with pytest.raises(ZeroDivisionError), drawer:
        raise ZeroDivisionError
    assert not drawer.is_open


def test_a_closed_camera_says_how_to_open_it() -> None:
    camera = NoCamera(Options())
    with pytest.raises(DeviceError, match=r"NoCamera is closed; open\(\) it"):
        camera.read()
    with camera, pytest.raises(CameraLost):
        camera.read()
    with pytest.raises(DeviceError, match="closed"):
        camera.read()
