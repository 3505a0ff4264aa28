"""Force while nothing touches a recorded sensor: ``python -m experiments.undeformed DATA``.

One reference serves many trials. ``slip/gripper_pair``: of each object and camera, the last frame
of a trial whose object was lost; the other trials' last frames are measured by
``core.force_elastic`` with the slopes of another unit. ``force/grip``: the first frame of one clip;
frames whose labelled force is nearly 0 are measured by ``core.load``, in newtons by a line that was
fitted to clips of other objects. As a control, frames in which an object is held.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import cv2
import numpy as np

from experiments.grip_force import by_object
from tactile_core.algorithms.arrays.types import Array
from tactile_core.builtin.force_linear import LinearForce
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.force.result import held_out_forces
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import ForceSamples, SensorContext
from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import RelativeLoad, Wrench

PROFILES = Path(__file__).with_name("profiles")
MARKED: dict[str, Any] = {
    "gel": {"markers": "auto", "thickness_mm": 4.0, "shear_modulus_mpa": 0.145},
    "estimators": {
        "markers": {"use": "core.markers"},
        "tracking": {"use": "core.marker_tracking"},
        "displacement": {"use": "core.displacement"},
        "force": {"use": "core.force_elastic"},
    },
}
"""Printed dots, and a stiffness that is not that of the unit, which nobody measured."""
BALL_MM = 6.31
TAIL = 4
"""Last frames of a trial that are measured."""
LONGEST = 440
"""Longer trials were cut off before their end."""
FREE_N, HELD_N = 0.05, 1.0
"""Labelled forces below which nothing touches, and from which an object is held."""


class Measured(NamedTuple):
    """A frame's force and its standard deviation, and whether an object was held."""

    force_n: float
    std_n: float
    held: bool


def gripper_pair(data: Path) -> dict[str, list[Measured]]:
    """Measure the last frames of all trials of each object and camera."""
    presses = data / "gelsight_mini" / "ball_presses"
    bundle = calibrate(
        PROFILES / "gelsight_mini.yaml",
        presses,
        presses / "background.png",
        ball_diameter_mm=BALL_MM,
        scored=False,
    ).bundle
    folder = data / "slip" / "gripper_pair"
    with (folder / "labels.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if int(row["n_frames"]) < LONGEST]
    rows.sort(key=lambda row: (row["object"], row["video"], row["slip"] == "0", row["trial"]))
    found: dict[str, list[Measured]] = {}
    for (name, video), group in groupby(rows, key=lambda row: (row["object"], row["video"])):
        first, *others = group
        if first["slip"] == "0":
            continue
        with TemporaryDirectory() as temporary:
            reference = Path(temporary) / "reference.png"
            cv2.imwrite(str(reference), last_frames(folder / name / first["trial"] / video)[-1])
            for row in others:
                tail = last_frames(folder / name / row["trial"] / video)
                held = row["slip"] == "0"
                for wrench in wrenches(tail, reference, bundle):
                    assert wrench.std is not None
                    size = float(np.linalg.norm(wrench.values[:3]))
                    std = float(np.linalg.norm(wrench.std[:3]) / np.sqrt(3))
                    found.setdefault(f"{name}, {video}", []).append(Measured(size, std, held))
    return found


def last_frames(video: Path) -> list[Array]:
    """Return the last frames of a recording."""
    frames: list[Array] = []
    capture = cv2.VideoCapture(str(video))
    while True:
        there, frame = capture.read()
        if not there:
            return frames
        frames = [*frames[1 - TAIL :], frame]


def wrenches(frames: list[Array], reference: Path, bundle: Bundle) -> Iterator[Wrench]:
    """Measure these frames with the whole chain."""
    with TemporaryDirectory() as temporary:
        for number, frame in enumerate(frames):
            cv2.imwrite(str(Path(temporary) / f"{number}.png"), frame)
        profile = load_profile(PROFILES / "gelsight_mini.yaml", overrides=MARKED)
        with open_sensor(profile, bundle=bundle, input=temporary, reference=reference) as sensor:
            for reading in sensor.stream():
                yield reading[Wrench]


def grip(data: Path) -> list[Measured]:
    """Measure all frames of all clips, with one reference for all of them."""
    clips = sorted((data / "force" / "grip").glob("*.avi"))
    profile = load_profile(PROFILES / "grip_wedge.yaml")
    step = LinearForce(Options(), SensorContext(profile.image, profile.gel))
    samples = []
    with TemporaryDirectory() as temporary:
        reference = Path(temporary) / "reference.png"
        cv2.imwrite(str(reference), cv2.VideoCapture(str(clips[0])).read()[1])
        for clip in clips[1:]:
            with clip.with_name(f"{clip.stem}_labels.csv").open() as file:
                force = [float(row["force_N"]) for row in csv.DictReader(file)]
            with open_sensor(profile, input=clip, reference=reference) as sensor:
                loads = [RelativeLoad(reading[RelativeLoad].load) for reading in sensor.stream()]
            features = np.array([step.features(None, None, None, None, one) for one in loads])
            forces = np.full((len(loads), 4), np.nan)
            forces[:, 2] = force[: len(loads)]
            samples.append(ForceSamples(clip.stem, features, forces))
    objects = by_object(samples)
    found, std = held_out_forces(objects, step.fit)
    true = np.concatenate([one.forces for one in objects])[:, 2]
    return [
        Measured(abs(float(force)), float(sigma), bool(label >= HELD_N))
        for force, sigma, label in zip(found[:, 2], std[:, 2], true, strict=True)
        if label < FREE_N or label >= HELD_N
    ]


def shown(name: str, frames: list[Measured]) -> str:
    """Return a line of the table."""
    parts = []
    for held, word in ((False, "undeformed"), (True, "held")):
        here = [one for one in frames if one.held is held]
        if here:
            within = sum(one.force_n <= 2 * one.std_n for one in here)
            std = np.median([one.std_n for one in here])
            size = np.median([one.force_n for one in here])
            parts.append(
                f"{word}: {within} of {len(here)} within 2 σ, force {size:.3f} N, σ {std:.3f} N"
            )
    return f"{name}: " + "; ".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    given = parser.parse_args()
    trials = gripper_pair(given.data)
    for name, frames in trials.items():
        print(shown(name, frames), flush=True)
    print(shown("gripper_pair", [one for frames in trials.values() for one in frames]), flush=True)
    print(shown("grip", grip(given.data)))


if __name__ == "__main__":
    main()
