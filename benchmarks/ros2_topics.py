"""A sensor over DDS into a second process: ``python benchmarks/ros2_topics.py --seconds 60``.

``tactile ros2`` plays images of a virtual sensor at 30 Hz, measures them and publishes all topics;
this process subscribes to all, over the loopback interface. Printed are the messages that are lost
between the first and the last that arrive, the error of the stamps' intervals, the time from a
stamp to the arrival, and how many heights are, bit for bit, those measured here.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from support.ros2_subscriber import LOOPBACK, OWN_DOMAIN, Subscriber, stamp_ns

from tactile_core import HeightMap, load_profile, open_sensor
from tactile_core.calibration.virtual_unit import calibrate_virtual_unit
from tactile_core.formats.images import write_png
from tactile_ros2.topics import DIAGNOSTICS, topics_of
from tactile_rosbag.names import SensorNames

FPS = 30.0  # Rate at which a folder of images is played
DISTINCT = 60  # Images that are rendered; the recording repeats them


class Content(NamedTuple):
    """What is kept of a message: a minute of images is large."""

    stamp_ns: int
    digest: bytes


class Digests(Subscriber):
    """Keeps stamps and digests."""

    def kept(self, message: Any) -> Content | None:
        stamped = hasattr(message, "header")
        digest = sha256(message.data).digest() if hasattr(message, "encoding") else b""
        return Content(stamp_ns(message), digest) if stamped else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("profile", nargs="?", default="digit")
    parser.add_argument("--seconds", type=float, default=60.0)
    given = parser.parse_args()
    os.environ["CYCLONEDDS_URI"] = LOOPBACK
    names = SensorNames.of_unit(None, load_profile(given.profile).name)
    with TemporaryDirectory() as temporary:
        folder, bundle = Path(temporary) / "frames", Path(temporary) / "bundle"
        make_recording(given.profile, folder, bundle, round(given.seconds * FPS) + DISTINCT)
        options = ["--input", str(folder), "--bundle", str(bundle), "--domain", str(OWN_DOMAIN)]
        expected: list[bytes] = []
        with open_sensor(given.profile, input=folder, bundle=bundle) as sensor:
            topics = {
                names.topic(one.name): one.message for one in topics_of(sensor.pipeline.gives)
            }
            for reading in sensor.stream():
                metres = (reading[HeightMap].finite().mm.astype(np.float64) * 1e-3).astype("<f4")
                expected.append(sha256(metres).digest())
        with Digests(OWN_DOMAIN, topics) as subscriber:
            command = [sys.executable, "-m", "tactile_core.cli", "ros2", given.profile, *options]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        report(subscriber, names, expected)


def make_recording(profile: str, folder: Path, bundle: Path, count: int) -> None:
    """Write a bundle, and a folder of images that repeat after some seconds."""
    overrides = {"camera": {"use": "sim.virtual", "loop": True}}
    virtual = load_profile(profile, sim=True, overrides=overrides)
    calibrated = calibrate_virtual_unit(virtual)
    calibrated.save(bundle)
    folder.mkdir()
    with open_sensor(virtual, bundle=calibrated) as sensor:
        for number in range(DISTINCT):
            frame = sensor.acquire()
            assert frame is not None
            write_png(folder / f"{number:06d}.png", frame.pixels)
    for number in range(DISTINCT, count):
        os.link(folder / f"{number % DISTINCT:06d}.png", folder / f"{number:06d}.png")


def report(subscriber: Subscriber, names: SensorNames, expected: list[bytes]) -> None:
    """Print a line for each topic that has stamps."""
    print(f"load {os.getloadavg()[0]:.1f}; {len(expected)} observations at {FPS:g} Hz")
    heights = subscriber.arrived[names.topic("height")]
    # the last observation is that of the last stamp; others follow from their stamps
    last_ns, last = heights[-1].message.stamp_ns, len(expected) - 1
    for topic, arrived in subscriber.arrived.items():
        stamps = np.array([one.message.stamp_ns for one in arrived if one.message is not None])
        if topic.endswith(DIAGNOSTICS) or not len(stamps):
            print(f"{topic}: {len(arrived)} messages")
            continue
        numbers = np.rint(last - (last_ns - stamps) * 1e-9 * FPS).astype(int)
        off_s = np.abs((last - numbers) / FPS - (last_ns - stamps) * 1e-9)
        lost = numbers[-1] - numbers[0] + 1 - len(set(numbers.tolist()))
        late_ms = 1e3 * (np.array([one.at_s for one in arrived]) - stamps * 1e-9)
        starting = stamps < stamps[0] + 1e9  # the first frame waits for what is imported late
        median, p99 = np.percentile(late_ms[~starting], [50, 99])
        print(
            f"{topic}: {len(stamps)} messages in {(stamps[-1] - stamps[0]) * 1e-9:.1f} s, {lost} "
            f"lost; stamps off by {1e3 * off_s.max():.6f} ms at most; latency {median:.1f} ms in "
            f"the median, {p99:.1f} ms at 99 %, {late_ms[~starting].max():.1f} ms at most after "
            f"the first second, {late_ms[starting].max():.1f} ms in it"
        )
        if topic.endswith("height"):
            digests = [one.message.digest for one in arrived]
            same = sum(expected[n] == d for n, d in zip(numbers, digests, strict=True))
            print(f"{topic}: {same} of {len(digests)} equal those measured in this process")


if __name__ == "__main__":
    main()
