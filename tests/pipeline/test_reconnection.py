"""A live sensor is opened again after its camera or its light box was unplugged."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.light_box import LightBox
from support.live_sensor import box as serial_box
from support.live_sensor import profile, send, stream
from support.mjpeg_server import MjpegServer

from tactile_core import open_sensor
from tactile_core.acquisition.free_running import Clock
from tactile_core.errors import CameraLost, CameraTimeout, DeviceAbsent, InputError, LightsLost
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.frame_source import Reconnection
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sensor import Sensor
from tactile_core.quantities import Frame
from tactile_core.testing.imports import Footprint

PATIENCE_S = 20.0
LOST_S = 0.25


class Network:
    """A camera's server that can go away and come back at the same address."""

    def __init__(self) -> None:
        self.server = MjpegServer(send).__enter__()

    def lost_for(self, duration_s: float) -> threading.Thread:
        """Stop the server, and start it again after a time."""
        self.server.close()
        return started(duration_s, self.back)

    def back(self) -> None:
        self.server = MjpegServer(send, self.server.port).__enter__()


def started(delay_s: float, action: Callable[[], None]) -> threading.Thread:
    timer = threading.Timer(delay_s, action)
    timer.start()
    return timer


@pytest.fixture
def network() -> Iterator[Network]:
    network = Network()
    yield network
    network.server.close()


def opened(
    folder: Path, network: Network, reconnect_s: float = PATIENCE_S, driver: str | None = None
) -> Sensor:
    path = profile(folder, stream(network.server.url), driver)
    return open_sensor(path, reference="first", timeout_s=PATIENCE_S, reconnect_s=reconnect_s)


def after_a_loss(sensor: Sensor, first: Reading) -> list[Reading]:
    """Read until a reading warns of a gap, and one more."""
    readings = [first]
    while not any("was lost" in warning for warning in readings[-1].warnings):
        readings.append(sensor.read())
    return [*readings, sensor.read()]


def read_until_it_fails(sensor: Sensor) -> None:
    while True:
        sensor.read()


def assert_continuous(readings: list[Reading]) -> None:
    numbers = [reading.frame.sequence for reading in readings]
    times = [reading.frame.timestamp_s for reading in readings]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert times == sorted(set(times))
    *_, first, then = readings
    assert sum("was lost" in warning for warning in first.warnings) == 1
    assert not any("was lost" in warning for warning in then.warnings)


def test_a_camera_that_comes_back_is_read_on(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    resumed: list[Pipeline] = []
    monkeypatch.setattr(Pipeline, "resume", lambda pipeline: resumed.append(pipeline))
    before = Footprint.take_snapshot()
    with opened(tmp_path, network) as sensor:
        first = sensor.read()
        reference = sensor.pipeline.reference
        thread = network.lost_for(LOST_S)
        readings = after_a_loss(sensor, first)
        thread.join()
        assert sensor.pipeline.reference is reference
        assert resumed == [sensor.pipeline]
    network.server.close()
    assert before.find_leaks() == ""
    assert_continuous(readings)
    (warning,) = (one for one in readings[-2].warnings if "lost" in one)
    assert warning.startswith("the camera was lost, and there was no frame for ")
    gap_s = readings[-2].frame.timestamp_s - readings[-3].frame.timestamp_s
    assert f"for {gap_s:.1f} s; reference and tare are kept" in warning
    assert gap_s > LOST_S
    network.back()


def test_a_camera_that_stays_away_is_lost_after_the_time(network: Network, tmp_path: Path) -> None:
    with opened(tmp_path, network, 0.3) as sensor:
        sensor.read()
        network.server.close()
        with pytest.raises(CameraLost) as caught:
            read_until_it_fails(sensor)
    assert any("not opened again within 0.3 s: http" in note for note in caught.value.__notes__)
    network.back()


def test_without_a_time_a_loss_is_an_error_at_once(network: Network, tmp_path: Path) -> None:
    with opened(tmp_path, network, 0.0) as sensor:
        sensor.read()
        network.server.close()
        with pytest.raises(CameraLost) as caught:
            read_until_it_fails(sensor)
    assert not any("opened again" in note for note in getattr(caught.value, "__notes__", ()))
    network.back()


@pytest.mark.skipif(not sys.platform.startswith(("linux", "darwin")), reason="needs terminals")
def test_a_light_box_that_is_plugged_in_again_is_driven_on(
    network: Network, tmp_path: Path
) -> None:
    pytest.importorskip("serial", reason="needs pyserial")
    before = Footprint.take_snapshot()
    box = LightBox(lights=3)
    port = tmp_path / "port"  # as in /dev/serial/by-id, the name is that of the device
    port.symlink_to(box.port)
    with opened(tmp_path, network, driver=serial_box(port)) as sensor:
        first = sensor.read()
        assert box.levels[-1] == [255, 255, 255]
        box.unplug()
        port.unlink()
        other = LightBox(lights=3)
        thread = started(LOST_S, lambda: port.symlink_to(other.port))
        readings = after_a_loss(sensor, first)
        thread.join()
        assert other.levels == [[0, 0, 0], [255, 255, 255]]
    assert_continuous(readings)
    assert any(one.startswith("the light box was lost") for one in readings[-2].warnings)
    assert other.levels[-1] == [0, 0, 0]
    other.unplug()
    network.server.close()
    assert before.find_leaks() == ""
    network.back()


class Devices:
    """Devices that can be opened from a time on, on a virtual clock."""

    def __init__(self, back_s: float) -> None:
        self.now_s, self.back_s, self.opened, self.closed = 10.0, back_s, 0, 0

    def open(self) -> None:
        self.opened += 1
        if self.now_s < self.back_s:
            raise DeviceAbsent("no camera is connected")

    def close(self) -> None:
        self.closed += 1
        raise LightsLost("the light box was disconnected")

    def sleep(self, duration_s: float) -> None:
        self.now_s += duration_s

    def reconnection(self, patience_s: float) -> Reconnection:
        clock = Clock(lambda: self.now_s, self.sleep)
        return Reconnection(patience_s, self.open, self.close, clock)


def frame(timestamp_s: float) -> Frame:
    return Frame(np.zeros((2, 2, 3), np.uint8), ("r", "g", "b"), 0.1, timestamp_s=timestamp_s)


def test_devices_are_closed_before_each_attempt_although_closing_fails() -> None:
    devices = Devices(back_s=11.0)
    reconnection = devices.reconnection(5.0)
    reconnection.saw(frame(10.0))
    assert reconnection.warnings() == ()
    reconnection.after(LightsLost("gone"))
    assert devices.opened == devices.closed > 2
    assert devices.now_s == pytest.approx(11.0, abs=0.11)
    reconnection.saw(frame(11.5))
    (warning,) = reconnection.warnings()
    assert warning.startswith("the light box was lost, and there was no frame for 1.5 s;")
    assert reconnection.warnings() == ()


def test_after_the_time_the_first_error_is_raised() -> None:
    devices = Devices(back_s=99.0)
    lost = CameraLost("the camera was unplugged")
    with pytest.raises(CameraLost) as caught:
        devices.reconnection(2.0).after(lost)
    assert caught.value is lost
    assert lost.__notes__ == ["not opened again within 2 s: no camera is connected"]
    assert devices.now_s == pytest.approx(12.0)


@pytest.mark.parametrize("patience_s", [-1.0, float("nan")])
def test_a_time_is_zero_or_more(patience_s: float) -> None:
    with pytest.raises(InputError, match="give the seconds, 0 for never"):
        Devices(0.0).reconnection(patience_s)


def test_a_stall_is_no_loss(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened(tmp_path, network) as sensor:
        sensor.read()

        def stalled(*_: Any) -> None:
            raise CameraTimeout("no image")

        monkeypatch.setattr("tactile_core.acquisition.acquisition.Acquisition.observe", stalled)
        began_s = time.monotonic()
        with pytest.raises(CameraTimeout):
            sensor.read()
        assert time.monotonic() - began_s < PATIENCE_S
