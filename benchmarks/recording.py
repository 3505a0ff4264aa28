"""What recording costs: ``PYTHONPATH=tests python benchmarks/recording.py [--out FOLDER]``.

*Raw rate*: a camera sends 640 × 480 RGB images at 300 Hz into a sensor whose chain measures 15 of
them a second; images a second that are in the file. *Raw*: the same at 60 Hz; images lost. *MJPG*:
a server in a process of its own sends JPEG images at 60 Hz, which nobody measures; images lost, and
processor time of this process with a recording and without. The folder needs 4 GB.
"""

from __future__ import annotations

import argparse
import tempfile
import threading
import time
from pathlib import Path
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from support.mjpeg_server import MjpegProcess

from tactile_core.acquisition.devices import Devices, make_lights
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.recording_format import ImageEntry
from tactile_core.interfaces.streaming.streaming_camera import ImageSource, StreamingCamera
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Image
from tactile_core.recordings.source import recording_file
from tactile_sim import VirtualStage

PROFILE = "hex_fingertip"
FASTEST_HZ, RAW_HZ, CHAIN_HZ, MJPG_HZ = 300.0, 60.0, 15.0, 60.0
SIZE = (480, 640)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="a folder on the disk to measure")
    parser.add_argument("--raw-seconds", type=float, default=60)
    parser.add_argument("--mjpg-seconds", type=float, default=600)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.out) as folder:
        images = shown()
        print_raw("raw rate", images, FASTEST_HZ, 10, Path(folder))
        print_raw("raw", images, RAW_HZ, given.raw_seconds, Path(folder))
        print_mjpg(given.mjpg_seconds, Path(folder))


class Paced(ImageSource):
    """Sends images at a rate, or as fast as they are taken, and counts them."""

    def __init__(self, images: list[NDArray[np.uint8]], rate_hz: float) -> None:
        self._images, self._period_s = images, 1 / rate_hz
        self._ended = threading.Event()
        self._due_s = time.monotonic()
        self.sent = 0

    def grab(self) -> Image | None:
        self._due_s += self._period_s
        if self._ended.wait(max(0.0, self._due_s - time.monotonic())):
            return None
        pixels = self._images[self.sent % len(self._images)].copy()  # a driver gives each its own
        self.sent += 1
        return Image(pixels, timestamp_s=time.monotonic(), wall_time_s=time.time())

    def interrupt(self) -> None:
        self._ended.set()

    def close(self) -> None:
        pass


class PacedCamera(StreamingCamera):
    """A camera that sends given images."""

    def __init__(self, source: Paced) -> None:
        super().__init__(Options())
        self._source = source

    def _connect(self) -> ImageSource:
        return self._source


def shown() -> list[NDArray[np.uint8]]:
    """Return images of a ball that is pressed."""
    stage = VirtualStage(PROFILE, seed=0, mode="fast")
    stage.indenter("sphere", diameter_mm=8)
    images = []
    for _ in range(8):
        images.append(np.ascontiguousarray(next(iter(stage.exposures()))))
        stage.press(depth_mm=0.05)
    return images


def sensor_with(source: Paced) -> Sensor:
    """Return a sensor with the chain of the profile and a camera that sends these images."""
    profile = load_profile(PROFILE, sim=True)
    devices = Devices(PacedCamera(source), make_lights(profile), None)
    with patch("tactile_core.pipeline.frame_source.make_devices", return_value=devices):
        return Sensor(profile, reference="first").open()


def print_raw(
    name: str, images: list[NDArray[np.uint8]], rate_hz: float, seconds: float, folder: Path
) -> None:
    source = Paced(images, rate_hz)
    path = folder / "raw.mcap"
    with sensor_with(source) as sensor:
        for _ in range(5):
            sensor.read()  # code is loaded
        began_s, used_s, readings = time.monotonic(), time.process_time(), 0
        sent = source.sent
        with sensor.record(path) as recording:
            while (elapsed_s := time.monotonic() - began_s) < seconds:
                sensor.read()
                readings += 1
                time.sleep(max(0.0, readings / CHAIN_HZ - elapsed_s))
            took_s, sent = time.monotonic() - began_s, source.sent - sent
        whole_s, used_s = time.monotonic() - began_s, time.process_time() - used_s
    numbers = sequences(path)
    found = len(numbers)
    print(
        f"{name}: {sent} images sent in {took_s:.1f} s ({sent / took_s:.0f} Hz), {found} in the "
        f"file ({found / whole_s:.0f} a second), {recording.dropped} left out, "
        f"{missing(numbers)} missing between the first and the last, "
        f"{readings / took_s:.1f} readings a second, {recording.bytes / whole_s / 1e6:.0f} MB/s, "
        f"processor {100 * used_s / whole_s:.0f} %, failure {recording.failure}",
        flush=True,
    )
    path.unlink()


def print_mjpg(seconds: float, folder: Path) -> None:
    path = folder / "mjpg.mcap"
    with MjpegProcess(MJPG_HZ, SIZE) as server:
        camera = {"camera": {"use": "core.stream", "url": server.url}}
        profile = load_profile(PROFILE, overrides=camera)
        with open_sensor(profile) as sensor:
            time.sleep(1)
            plain = share_of_processor(min(seconds, 60))
            before = statistics(sensor)
            began_s = time.monotonic()
            with sensor.record(path) as recording:
                recorded = share_of_processor(seconds)
            took_s, arrived = time.monotonic() - began_s, statistics(sensor) - before
    numbers = sequences(path)
    print(
        f"MJPG: {len(numbers)} images in {took_s:.0f} s ({len(numbers) / took_s:.1f} Hz), "
        f"{arrived} arrived, {missing(numbers)} missing "
        f"between the first and the last, {recording.dropped} left out, "
        f"{recording.bytes / 1e3 / len(numbers):.0f} kB each; "
        f"processor {100 * recorded:.2f} % with a recording, {100 * plain:.2f} % without: "
        f"{100 * (recorded - plain):.2f} % of a core",
        flush=True,
    )


def sequences(path: Path) -> list[int]:
    """Return the camera's numbers of the images in a file."""
    with recording_file(path) as file:
        return [e.described["sequence"] for e in file.entries if isinstance(e, ImageEntry)]


def missing(numbers: list[int]) -> int:
    return numbers[-1] - numbers[0] + 1 - len(numbers)


def statistics(sensor: Sensor) -> int:
    """Return the number of images that have arrived."""
    counts = sensor.camera.statistics
    assert counts is not None
    return counts.received


def share_of_processor(seconds: float) -> float:
    """Return the share of one core that this process uses while nothing else is done."""
    began_s, used_s = time.monotonic(), time.process_time()
    time.sleep(seconds)
    return (time.process_time() - used_s) / (time.monotonic() - began_s)


if __name__ == "__main__":
    main()
