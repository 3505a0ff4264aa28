"""A sensor over DDS into a second process: ``python benchmarks/ros2_topics.py --seconds 60``.

``tactile ros2`` plays images of a virtual sensor at 30 Hz, measures them and publishes all topics;
this process subscribes to all, over the loopback interface. Printed are the messages that are lost,
the largest error of the stamps' intervals, the time from a stamp to the arrival, and how many
heights are, bit for bit, those measured here. The latency holds only on a machine that does nothing
else.
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
    """Print a line for each topic."""
    print(f"load {os.getloadavg()[0]:.1f}; {len(expected)} observations at {FPS:g} Hz")
    for topic, arrived in subscriber.arrived.items():
        if not arrived or arrived[0].message is None or topic.endswith(DIAGNOSTICS):
            print(f"{topic}: {len(arrived)} messages")
            continue
        # the first is played before the second sets the pace
        kept = arrived[1:] if len(arrived) == len(expected) else arrived
        stamps = np.array([one.message.stamp_ns for one in kept])
        last = len(expected) - 1
        numbers = np.rint(last - (stamps[-1] - stamps) * 1e-9 * FPS).astype(int)
        off_ms = np.abs((last - numbers) / FPS - (stamps[-1] - stamps) * 1e-9) * 1e3
        late_ms = 1e3 * (np.array([one.at_s for one in kept]) - stamps * 1e-9)
        median, most, worst = np.percentile(late_ms, [50, 99, 100])
        print(
            f"{topic}: {len(arrived)} messages, {len(expected) - len(arrived)} lost; stamps off by "
            f"{off_ms.max():.4f} ms at most; latency {median:.1f} ms in the median, {most:.1f} ms "
            f"at 99 %, {worst:.1f} ms at most, {np.mean(late_ms <= 1e3 / FPS):.2%} within a frame"
        )
        if topic.endswith("height"):
            digests = [one.message.digest for one in kept]
            same = sum(expected[n] == d for n, d in zip(numbers, digests, strict=True))
            print(f"{topic}: {same} of {len(digests)} are those measured in this process")


if __name__ == "__main__":
    main()
