"""What goes wrong with a webcam, with the kernel's own drivers: torn, stalled, busy, unplugged."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from hardware.plugged import FIRST, LIT, PLUGS
from hardware.usbip_bus import Bus, wait_for, webcams_are_there

from tactile_core.builtin.cameras.uvc_camera import UvcCamera, UvcOptions
from tactile_core.errors import CameraLost, CameraTimeout, DeviceBusy, DeviceError
from tactile_core.testing.imports import Footprint

UNPLUGS = int(os.environ.get("TACTILE_UNPLUGS", "10"))
PATIENCE_S = 20.0
LOST_S = 2.0
"""Time within which a camera that is gone must be reported."""


def camera_of(serial: str = LIT) -> UvcCamera:
    return UvcCamera(UvcOptions(serial=serial))


def read_until_it_fails(camera: UvcCamera, timeout_s: float) -> None:
    until = time.monotonic() + 2 * PATIENCE_S
    while time.monotonic() < until:
        camera.read(timeout_s)


@contextmanager
def another_process(work: Callable[[], None]) -> Iterator[int]:
    """Work in a process of its own, which ends by kill −9; yield its id."""
    child = os.fork()
    if child == 0:
        try:
            work()
            time.sleep(60)
        finally:
            os._exit(0)
    try:
        yield child
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def test_torn_images_are_counted_and_left_out(bus: Bus) -> None:
    camera = camera_of()
    camera.set_drop("never")
    with camera:
        camera.read(PATIENCE_S)
        bus.ask(LIT, "tear", 3)
        for _ in range(20):
            assert camera.read(PATIENCE_S) is not None
        assert camera.statistics.torn == 3


def test_a_stalled_camera_times_out_and_goes_on(bus: Bus) -> None:
    with camera_of() as camera:
        camera.read(PATIENCE_S)
        bus.ask(LIT, "stall", 1)
        with pytest.raises(CameraTimeout):
            read_until_it_fails(camera, 0.5)
        bus.ask(LIT, "stall", 0)
        assert camera.read(PATIENCE_S) is not None


def test_closing_a_stalled_camera_takes_at_most_two_seconds(bus: Bus) -> None:
    camera = camera_of().open()
    bus.ask(LIT, "stall", 1)
    time.sleep(0.3)
    began = time.monotonic()
    camera.close()
    took_s = time.monotonic() - began
    bus.ask(LIT, "stall", 0)
    assert took_s < 4  # the guest's processor is emulated
    print(f"closed after {took_s:.2f} s", file=sys.stderr)


def test_a_camera_that_does_not_fit_on_the_bus_says_what_to_do(bus: Bus) -> None:
    before = Footprint.take_snapshot()
    bus.ask(FIRST, "crowd", 1)
    with camera_of(LIT) as camera:
        with pytest.raises(DeviceError, match=r"share its\s+bandwidth.*another port"):
            camera_of(FIRST).open()
        assert camera.read(PATIENCE_S) is not None
    assert before.find_leaks() == ""


def test_a_second_program_is_refused_with_the_name_of_the_first(bus: Bus) -> None:
    def hold() -> None:
        with camera_of() as camera:
            read_until_it_fails(camera, PATIENCE_S)

    with another_process(hold) as child:
        wait_for(lambda: is_streaming(bus))
        with pytest.raises(DeviceBusy, match=rf"is in use by .* \(process {child}\); close that"):
            camera_of().open()


def test_a_camera_whose_program_was_killed_opens_again(bus: Bus) -> None:
    before = Footprint.take_snapshot()
    for _ in range(2):
        with another_process(lambda: read_until_it_fails(camera_of().open(), PATIENCE_S)):
            wait_for(lambda: is_streaming(bus))
        with camera_of() as camera:
            assert camera.read(PATIENCE_S) is not None
    assert before.find_leaks() == ""


def is_streaming(bus: Bus) -> bool:
    """Whether the second webcam sends images."""
    first = bus.ask(LIT, "sent")
    time.sleep(0.2)
    return bus.ask(LIT, "sent") != first


def test_unplugged_at_any_moment_is_lost_within_two_seconds_and_opens_after_a_new_plug(
    bus: Bus,
) -> None:
    before = Footprint.take_snapshot()
    random = np.random.default_rng(1)
    camera = camera_of()
    took_s = []
    for _ in range(UNPLUGS):
        with camera:
            camera.read(PATIENCE_S)
            time.sleep(random.uniform(0, 0.1))
            bus.unplug(PLUGS[LIT])
            began_s = time.monotonic()
            with pytest.raises(CameraLost, match="was unplugged; connect it again"):
                read_until_it_fails(camera, PATIENCE_S)
            took_s.append(time.monotonic() - began_s)
        with pytest.raises(DeviceError, match=f"no connected camera has serial {LIT}"):
            camera.open()
        bus.plug(PLUGS[LIT])
        wait_for(webcams_are_there)
    with camera:
        assert camera.read(PATIENCE_S) is not None
    print(f"{UNPLUGS} times lost after at most {max(took_s):.2f} s", file=sys.stderr)
    assert max(took_s) < LOST_S
    assert before.find_leaks() == ""
