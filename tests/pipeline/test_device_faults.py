"""Faults of live devices: the right error in time, and afterwards nothing is left on or open."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from support.light_box import LightBox, light_box
from support.live_sensor import box as serial_box
from support.live_sensor import profile, send, stream
from support.mjpeg_server import Exchange, MjpegServer, jpeg
from support.virtual_lab import VirtualLab

from tactile_core import open_sensor
from tactile_core.acquisition import devices
from tactile_core.builtin.sequential import ReplayCamera
from tactile_core.errors import CameraTimeout, DeviceBusy, DeviceError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.pipeline.sensor import Sensor
from tactile_core.testing.imports import Footprint, within

if not sys.platform.startswith(("linux", "darwin")):
    pytest.skip("needs pseudo-terminals", allow_module_level=True)
pytest.importorskip("serial", reason="needs pyserial")

LIMIT_S = 20.0
DARK, BRIGHT = [0, 0, 0], [255, 255, 255]


@pytest.fixture
def box() -> Iterator[LightBox]:
    with light_box(lights=3) as one:
        yield one


@pytest.fixture
def url() -> Iterator[str]:
    with MjpegServer(send) as server:
        yield server.url


def opened(folder: Path, url: str, box: LightBox) -> Sensor:
    return open_sensor(profile(folder, stream(url), serial_box(box.port)), timeout_s=LIMIT_S)


def test_a_stall_times_out_and_closing_darkens_the_lights(tmp_path: Path, box: LightBox) -> None:
    stalled = threading.Event()

    def answer(exchange: Exchange) -> None:
        exchange.begin()
        number = 0
        while not stalled.wait(0.01):
            exchange.send_image(jpeg(number := (number + 1) % 250))
        exchange.stall()

    before = Footprint.take_snapshot()
    with MjpegServer(answer) as server, opened(tmp_path, server.url, box) as sensor:
        sensor.read()
        stalled.set()
        done = within(LIMIT_S, lambda: read_until_it_fails(sensor))
        assert isinstance(done.error, CameraTimeout)
    assert box.levels[-1] == DARK
    assert before.find_leaks() == ""


def read_until_it_fails(sensor: Sensor) -> None:
    while True:
        sensor.read(timeout_s=0.1)


def test_a_silent_box_is_an_error_and_the_camera_is_closed(
    tmp_path: Path, url: str, box: LightBox
) -> None:
    before = Footprint.take_snapshot()
    with opened(tmp_path, url, box) as sensor:
        sensor.read()
        box.answer = lambda words: b""
        done = within(LIMIT_S, lambda: read_until_it_fails(sensor))
        assert isinstance(done.error, DeviceError)
        assert "does not answer within 0.5 s" in str(done.error)
        closing = within(LIMIT_S, sensor.close)
        assert closing.ended
    assert before.find_leaks() == ""
    box.answer = box.proper
    with opened(tmp_path, url, box) as sensor:
        sensor.read()


def test_a_sensor_in_use_is_busy_and_stays_with_its_owner(
    tmp_path: Path, url: str, box: LightBox
) -> None:
    with opened(tmp_path, url, box) as sensor:
        sensor.read()
        with pytest.raises(DeviceBusy, match=f"the serial port {box.port} is in use"):
            opened(tmp_path, url, box)
        sensor.read()
        assert box.levels[-1] == BRIGHT


RUN = [sys.executable, "-m", "tactile_core.cli", "run"]


def started(folder: Path, url: str, box: LightBox) -> subprocess.Popen[str]:
    """Start a run, and wait for its first reading."""
    path = profile(folder, stream(url), serial_box(box.port))
    running = subprocess.Popen(
        [*RUN, str(path), "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert running.stdout is not None
    running.stdout.readline()
    assert box.levels[-1] == BRIGHT
    return running


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_switches_its_lights_off(
    tmp_path: Path, url: str, box: LightBox, number: signal.Signals
) -> None:
    running = started(tmp_path, url, box)
    os.kill(running.pid, number)
    _, err = running.communicate(timeout=60)
    assert running.returncode == 128 + number
    assert "Traceback" not in err
    assert box.levels[-1] == DARK


def test_after_a_kill_nobody_keeps_the_box_alive_and_the_next_run_begins_dark(
    tmp_path: Path, url: str, box: LightBox
) -> None:
    running = started(tmp_path, url, box)
    running.kill()
    running.communicate(timeout=60)
    asked, levels = len(box.asked), len(box.levels)
    threading.Event().wait(0.5)  # longer than the watchdog of the box, 0.4 s
    assert len(box.asked) == asked
    with opened(tmp_path, url, box):
        assert box.levels[levels] == DARK


def test_an_interrupt_within_a_request_darkens_the_lights(
    tmp_path: Path, url: str, box: LightBox, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tactile_core.builtin.leds.serial_link import SerialLink

    acknowledged = SerialLink._await_answer

    def interrupted(link: SerialLink, *arguments: Any) -> bool:
        if threading.current_thread() is not threading.main_thread():
            return acknowledged(link, *arguments)  # what keeps the box alive is not interrupted
        monkeypatch.setattr(SerialLink, "_await_answer", acknowledged)
        raise KeyboardInterrupt

    with opened(tmp_path, url, box) as sensor:
        sensor._source.acquisition.arm()  # the lights are set again
        monkeypatch.setattr(SerialLink, "_await_answer", interrupted)
        with pytest.raises(KeyboardInterrupt):
            sensor.read()
    assert box.levels[-1] == DARK


class Stuck(LightDriver):
    """Lights that fail when they are switched off."""

    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        raise DeviceError("the box is stuck")

    def _set(self, levels: Mapping[str, float]) -> None:
        if self.lit and not levels:
            raise DeviceError("the lights stay on")
        self.lit = bool(levels)

    lit = False


def test_lights_that_cannot_be_switched_off_do_not_keep_the_camera_open(
    lab: VirtualLab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ReplayCamera, "live", True)
    monkeypatch.setattr(devices, "_make_driver", lambda profile: Stuck(Options()))
    sensor = open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses)
    sensor.read()
    with pytest.raises(DeviceError, match="the box is stuck"):
        sensor.close()
    assert not sensor.camera.is_open
    assert sensor._source.driver is not None
    assert not sensor._source.driver.is_open
    sensor.close()
