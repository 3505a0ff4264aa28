"""Devices opened a thousand times, streamed for minutes and unplugged at random moments.

``make soak SOAK=0.1`` runs a tenth. USB devices live in a program of their own, in whose USB an
emulator plugs them.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

if not sys.platform.startswith("linux"):
    pytest.skip("counts what /proc lists", allow_module_level=True)
pytest.importorskip("serial", reason="needs pyserial")

from support import gige_camera, usb_emulation
from support.gige_camera import ADDRESS, OtherProcess, alone
from support.light_box import LIGHTS, light_box
from support.mjpeg_server import MjpegProcess
from support.soak import SHARE, Held, growth, share_of

from tactile_core.builtin.cameras.folder_camera import FolderCamera, FolderOptions
from tactile_core.builtin.cameras.stream_camera import StreamCamera, StreamOptions
from tactile_core.builtin.leds.serial_leds import SerialLeds
from tactile_core.errors import CameraLost, CameraTimeout
from tactile_core.interfaces.camera import Camera
from tactile_core.testing.imports import within
from tactile_genicam.camera import GenicamCamera, GenicamOptions

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]

CYCLES, UNPLUGS, STREAM_S = 1000, 100, 600
WARM, SAMPLES = 20, 20
"""Cycles after which caches are filled, and looks at what the process holds."""

STREAM_SAMPLES, WARM_SHARE = 100, 0.2
"""Looks during a stream, of which a few fall between two images, a megabyte each; share of the time
after which buffers have their size."""

PATIENCE_S = 20.0
SMALL = 48, 64
MIB = 1.0
"""What may not be lost."""
IN_FLIGHT_MIB = 8.0
"""Four images of each camera, which a busy computer has in its buffers: a short stream may end with
more of them than it began with. A leak of one image a second is ten times as much in a minute."""
NOTICED_S, GENICAM_NOTICED_S = 2.0, 12.0
"""Longest time until a loss is noticed; Aravis asks a silent camera for five seconds."""

RANDOM = np.random.default_rng(0)

Cycle = Callable[[], None]


@contextmanager
def folder(path: Path) -> Iterator[Cycle]:
    cv2.imwrite(str(path / "0001.png"), np.zeros((48, 64, 3), np.uint8))
    yield lambda: read_once(
        FolderCamera(FolderOptions.model_validate({"path": path, "existing": True}))
    )


@contextmanager
def stream(path: Path) -> Iterator[Cycle]:
    with MjpegProcess(200, SMALL) as server:
        yield lambda: read_once(StreamCamera(StreamOptions(url=server.url)))


@contextmanager
def genicam(path: Path) -> Iterator[Cycle]:
    if gige_camera.missing():
        pytest.skip(gige_camera.missing())
    options = {"address": ADDRESS, "region": (0, 0, 128, 64), "fps": 200, "exposure_time_s": 0.001}
    with alone(), OtherProcess("SOAK-1"):
        yield lambda: read_once(GenicamCamera(GenicamOptions.model_validate(options)))


@contextmanager
def serial_leds(path: Path) -> Iterator[Cycle]:
    def cycle() -> None:
        with SerialLeds(SerialLeds.Options(lights=LIGHTS, port=box.port)) as driver:
            driver.set({"led1": 1.0})

    with light_box() as box:
        yield cycle


def read_once(camera: Camera) -> None:
    with camera:
        assert camera.read(PATIENCE_S) is not None


def report(text: str) -> None:
    print(f"\n{text} ({SHARE:.0%} of the soak)", flush=True)


def assert_nothing_left(samples: Sequence[Held], what: str, allowed_mib: float = MIB) -> None:
    left = growth(samples)
    report(f"{what}: {left}")
    assert left.threads <= 0
    assert left.files <= 0
    assert left.mib < allowed_mib / 2


@pytest.mark.parametrize("kind", [folder, stream, genicam, serial_leds])
def test_a_thousand_openings_leave_nothing(kind: Callable[[Path], Any], tmp_path: Path) -> None:
    cycles = share_of(CYCLES)
    with kind(tmp_path) as cycle:
        for _ in range(WARM):
            cycle()
        samples = []
        for number in range(cycles):
            cycle()
            if number % max(1, cycles // SAMPLES) == 0:
                samples.append(Held.now())
    assert_nothing_left(samples, f"{kind.__name__}, {cycles} openings")


USB_CYCLES = f"""
import json
from dataclasses import asdict
from support.soak import Held
from tactile_core.builtin.leds.usb_leds import UsbLeds
def cycle():
    with UsbLeds(UsbLeds.Options(lights={LIGHTS!r})) as driver:
        driver.set(dict(led1=1.0))
for _ in range({WARM}):
    cycle()
samples = []
for number in range(CYCLES):
    cycle()
    if number % max(1, CYCLES // {SAMPLES}) == 0:
        samples.append(asdict(Held.now()))
print(json.dumps(samples))
"""


@pytest.mark.skipif(bool(usb_emulation.missing()), reason=usb_emulation.missing())
def test_a_thousand_openings_of_usb_lights_leave_nothing() -> None:
    cycles = share_of(CYCLES)
    (line,), _ = usb_emulation.printed_by(USB_CYCLES.replace("CYCLES", str(cycles)))
    samples = [Held(**held) for held in json.loads(line)]
    assert_nothing_left(samples, f"usb_leds, {cycles} openings")


@pytest.mark.skipif(bool(gige_camera.missing()), reason=gige_camera.missing())
def test_ten_minutes_of_two_streams_leave_nothing() -> None:
    seconds = share_of(STREAM_S)
    options = {"address": ADDRESS, "region": (0, 0, 640, 480), "fps": 30}
    with alone(), OtherProcess("SOAK-2"), MjpegProcess(30, (480, 640)) as server:
        cameras = (
            GenicamCamera(GenicamOptions.model_validate(options)),
            StreamCamera(StreamOptions(url=server.url)),
        )
        with cameras[0], cameras[1]:
            for camera in cameras:
                camera.set_drop("never")
            ended = threading.Event()

            def read_on(camera: Camera) -> None:
                while not ended.is_set():
                    assert camera.read(PATIENCE_S) is not None

            samples = []
            with ThreadPoolExecutor() as readers:
                reading = [readers.submit(read_on, camera) for camera in cameras]
                ends_s = time.monotonic() + seconds
                time.sleep(WARM_SHARE * seconds)
                while time.monotonic() < ends_s:
                    samples.append(Held.now())
                    time.sleep(seconds / STREAM_SAMPLES)
                ended.set()
                for one in reading:
                    one.result()
            counts = [camera.statistics for camera in cameras]
    allowed_mib = MIB if SHARE >= 1 else IN_FLIGHT_MIB
    assert_nothing_left(samples, f"streams of {seconds} s, {counts}", allowed_mib)
    # a busy computer loses packets of GigE Vision, and with them images, which are counted as torn
    assert all(count is not None and not count.dropped for count in counts)
    assert counts[1] is not None
    assert counts[1].torn == 0


def lost_after(camera: Camera, unplug: Callable[[], None], limit_s: float) -> float:
    """Read, unplug the camera in the meantime, and return how long its loss took to be noticed."""
    moment_s = []

    def later() -> None:
        time.sleep(RANDOM.uniform(0, 0.3))
        moment_s.append(time.monotonic())
        unplug()

    def until_it_fails() -> None:
        while True:
            with suppress(CameraTimeout):  # an earlier sign
                camera.read(0.5)

    thread = threading.Thread(target=later)
    thread.start()
    done = within(limit_s, until_it_fails)
    noticed_s = time.monotonic()
    thread.join()
    assert done.ended, f"the loss was not noticed within {limit_s:g} s"
    assert isinstance(done.error, CameraLost), done.error
    return noticed_s - moment_s[0]


def test_a_network_camera_is_lost_whenever_its_server_dies() -> None:
    took_s = []
    samples = []
    for _ in range(share_of(UNPLUGS)):
        server = MjpegProcess(30, (480, 640))
        with server, StreamCamera(StreamOptions(url=server.url, timeout_s=1.0)) as camera:
            took_s.append(lost_after(camera, server.kill, NOTICED_S))
        samples.append(Held.now())
    report(f"the server of core.stream died {len(took_s)} times: lost after {slowest(took_s)}")
    assert growth(samples).threads <= 0
    assert growth(samples).files <= 0


@pytest.mark.skipif(bool(gige_camera.missing()), reason=gige_camera.missing())
def test_a_machine_vision_camera_is_lost_whenever_it_dies() -> None:
    options = {"address": ADDRESS, "region": (0, 0, 128, 64), "fps": 30}
    took_s = []
    with alone():
        for _ in range(share_of(UNPLUGS)):
            with OtherProcess("SOAK-3") as other:
                camera = GenicamCamera(GenicamOptions.model_validate(options))
                with camera:
                    assert camera.read(PATIENCE_S) is not None
                    took_s.append(lost_after(camera, other.kill, GENICAM_NOTICED_S))
    report(f"genicam.camera was unplugged {len(took_s)} times: lost after {slowest(took_s)}")


USB_UNPLUGGED = f"""
import time
from tactile_core.builtin.leds.usb_leds import UsbLeds
from tactile_core.errors import DeviceError
driver = UsbLeds(UsbLeds.Options(lights={LIGHTS!r})).open()
try:
    while True:
        before_s = time.monotonic()
        driver.set(dict(led1=1.0))
except DeviceError as error:
    print(time.monotonic() - before_s, error)
driver.close()
"""


@pytest.mark.skipif(bool(usb_emulation.missing()), reason=usb_emulation.missing())
def test_usb_lights_are_lost_whenever_they_are_unplugged() -> None:
    took_s = []
    for _ in range(share_of(UNPLUGS)):
        after = int(RANDOM.integers(2, 300))
        (line,), _ = usb_emulation.printed_by(USB_UNPLUGGED, "unplug", after)
        duration_s, message = line.split(" ", 1)
        assert "was disconnected; plug it in and open the sensor again" in message
        took_s.append(float(duration_s))
    report(f"core.usb_leds was unplugged {len(took_s)} times: lost after {slowest(took_s)}")


def slowest(took_s: list[float]) -> str:
    return f"{np.median(took_s):.2f} s, {max(took_s):.2f} s at most"
