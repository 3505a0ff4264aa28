"""Two live fingers at different rates: cameras on the network, against servers on this machine."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event

import pytest
from support.mjpeg_server import Exchange, MjpegServer, jpeg
from support.sysfs import Sysfs

from tactile_core.builtin.cameras.uvc_camera import UvcCamera
from tactile_core.errors import CameraLost, CameraTimeout, DeviceError, InputError
from tactile_core.pipeline.opening import PairedReadings, SensorGroup, open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame
from tactile_core.testing.imports import Footprint

TICK_S = 0.03
SLOWER = 3
"""Ticks between two images of the slow finger."""

PROFILE = """\
schema: 1
name: bare_finger
image: {width_px: 64, height_px: 48, mm_per_px: 0.2}
"""


class Ticks:
    """A clock of ticks that both servers wait for; each image shows the number of its tick."""

    def __init__(self) -> None:
        self.begun = Event()
        self.begun_s = 0.0
        self.last = 0

    def begin(self) -> None:
        """Start the clock, once both cameras are connected."""
        self.begun_s = time.monotonic()
        self.begun.set()

    def stream(self, exchange: Exchange, every: int, until: int = 200) -> Iterator[int]:
        """Send an image at each of these ticks."""
        exchange.begin()
        self.begun.wait(20)
        for tick in range(every, until, every):
            wait_s = self.begun_s + tick * TICK_S - time.monotonic()
            if exchange.stopped.wait(max(wait_s, 0.0)):
                return
            exchange.send_image(jpeg(tick, (48, 64)))
            self.last = max(self.last, tick)
            yield tick


@contextmanager
def fingers(
    folder: Path, *, slow_until: int = 200, stalls: bool = False, timeout_s: float = 20.0
) -> Iterator[tuple[Ticks, SensorGroup]]:
    """Open a fast and a slow finger; nothing stays behind."""
    (folder / "bare_finger.yaml").write_text(PROFILE)
    ticks = Ticks()

    def fast(exchange: Exchange) -> None:
        list(ticks.stream(exchange, 1))

    def slow(exchange: Exchange) -> None:
        list(ticks.stream(exchange, SLOWER, slow_until))
        if stalls:
            exchange.stall()

    def opened(url: str) -> Sensor:
        camera = {"use": "core.stream", "url": url, "timeout_s": 20.0}
        profile = load_profile(folder / "bare_finger.yaml", overrides={"camera": camera})
        return open_sensor(profile, timeout_s=timeout_s)

    before = Footprint.take_snapshot()
    with (
        MjpegServer(fast) as one,
        MjpegServer(slow) as other,
        SensorGroup([opened(one.url), opened(other.url)], tolerance_s=0.5 * TICK_S) as group,
    ):
        ticks.begin()
        yield ticks, group
    assert before.find_leaks() == ""


def shown(frame: Frame) -> int:
    return round(float(frame.pixels.mean()))


def ticks_of(pair: PairedReadings) -> tuple[int, ...]:
    return tuple(shown(reading.frame) for reading in pair.readings)


def test_each_image_of_the_slow_finger_is_paired_with_that_of_its_time(tmp_path: Path) -> None:
    with fingers(tmp_path) as (_, group):
        stream = group.stream()
        pairs = [next(stream) for _ in range(8)]
    apart = [abs(fast - slow) for fast, slow in map(ticks_of, pairs)]
    assert sorted(apart)[len(apart) // 2] == 0  # the machine may have paused once or twice
    assert all(ticks_of(pair)[1] % SLOWER == 0 for pair in pairs)
    assert all(pair.apart_s <= group.tolerance_s for pair in pairs)
    assert group.skipped > 0


def test_readings_stay_new_although_measuring_takes_longer_than_a_period(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with fingers(tmp_path) as (ticks, group):
        measure = Sensor.measure

        def slowly(self: Sensor, frame: Frame) -> object:
            time.sleep(2 * TICK_S)
            return measure(self, frame)

        monkeypatch.setattr(Sensor, "measure", slowly)
        stream = group.stream()
        behind = [ticks.last - ticks_of(next(stream))[1] for _ in range(10)]
    # a queue would add at least a tick with every pair
    assert min(behind[5:]) <= min(behind[:5]) + 1


@pytest.mark.parametrize(("stalls", "error"), [(False, CameraLost), (True, CameraTimeout)])
def test_a_lost_finger_is_an_error_that_names_it(
    tmp_path: Path, stalls: bool, error: type[DeviceError]
) -> None:
    with (
        fingers(tmp_path, slow_until=7, stalls=stalls, timeout_s=1.0) as (_, group),
        pytest.raises(error, match=r"^sensor 2 \(bare_finger\): "),
    ):
        list(group.stream())


def test_two_of_a_kind_with_nothing_to_choose_by_are_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr(UvcCamera, "sysfs", tmp_path / "sys")
    desk = Sysfs(tmp_path / "sys")
    desk.plug("1-2")
    desk.plug("1-3")
    with pytest.raises(
        DeviceError, match=r"sensor left: 2 cameras .*port 1-2.*port 1-3.*tactile devices --claim"
    ):
        SensorGroup.open("hex_fingertip", ("left", "right"), tolerance_s=0.02)


@pytest.mark.parametrize("serials", [(), ("left",), ("left", "left")])
def test_each_finger_has_its_own_serial(serials: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match="two or more, each once"):
        SensorGroup.open("hex_fingertip", serials, tolerance_s=0.02)


def test_if_one_finger_cannot_be_opened_none_stays_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed: list[str] = []

    class Opened:
        def __init__(self, unit: str) -> None:
            self.unit = unit

        def close(self) -> None:
            closed.append(self.unit)

    def opening(profile: object, *, serial: str, timeout_s: float) -> Opened:
        if serial == "right":
            raise DeviceError("unplugged")
        return Opened(serial)

    monkeypatch.setattr("tactile_core.pipeline.opening.open_sensor", opening)
    with pytest.raises(DeviceError, match=r"^sensor right: unplugged$"):
        SensorGroup.open("any", ("left", "right"), tolerance_s=0.02, timeout_s=2.0)
    assert closed == ["left"]
