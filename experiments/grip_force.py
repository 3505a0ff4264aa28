"""Newtons from a load without a unit: ``python experiments/grip_force.py CLIPS``.

A gripper presses five objects into a sensor without markers, calibration or gel data. A load is
computed from each frame; ``core.force_linear`` is fitted to it on four objects and predicts the
force of the fifth. Prints RMSE in N and in per cent of the range, for loading and for whole clips.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Sequence
from itertools import groupby
from pathlib import Path

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.builtin.force_linear import LinearForce
from tactile_core.calibration.force.result import held_out_forces, score_forces
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import ForceSamples, SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.pipeline.opening import open_sensor
from tactile_core.quantities import RelativeLoad

FIRST_FRAMES = 3
"""Frames at the beginning of a clip that nothing touches."""

Loads = Callable[[Path], Float64]


def high_pass_loads(clip: Path) -> Float64:
    """Mean change of what is finer than 4 px at 320 × 240, less its noise."""
    fine, video = [], cv2.VideoCapture(str(clip))
    while True:
        there, image = video.read()
        if not there:
            break
        small = cv2.resize(image, (320, 240), interpolation=cv2.INTER_AREA).astype(np.float32)
        fine.append(small - cv2.GaussianBlur(small, (0, 0), 4.0))
    undeformed = np.mean(fine[:FIRST_FRAMES], axis=0)
    found = np.array([np.abs(one - undeformed).mean() for one in fine], np.float64)
    return np.sqrt(np.maximum(found**2 - found[:FIRST_FRAMES].mean() ** 2, 0))


def loads_of(profile: str) -> Loads:
    """Return the loads that the steps of a profile measure."""

    def loads(clip: Path) -> Float64:
        with open_sensor(profile, input=clip, reference="first") as sensor:
            return np.array([reading[RelativeLoad].load for reading in sensor.stream()])

    return loads


def samples(clip: Path, loads: Loads, step: LinearForce) -> tuple[ForceSamples, ForceSamples]:
    """Return one clip until its largest force, and the whole clip."""
    with clip.with_name(f"{clip.stem}_labels.csv").open() as file:
        force = np.array([float(row["force_N"]) for row in csv.DictReader(file)])
    found = [RelativeLoad(float(load)) for load in loads(clip)]
    features = np.array([step.features(None, None, None, None, load) for load in found])
    forces = np.full((len(force), 4), np.nan)
    forces[:, 2] = force
    end = int(force.argmax()) + 1
    whole = ForceSamples(clip.stem, features, forces)
    return ForceSamples(clip.stem, features[:end], forces[:end]), whole


def by_object(clips: Sequence[ForceSamples]) -> list[ForceSamples]:
    """Join the clips of each object, so that a held-out sequence is an object."""
    groups = groupby(clips, key=lambda one: one.name.rsplit("_", 1)[0])
    return [
        ForceSamples(
            name,
            np.concatenate([one.features for one in group]),
            np.concatenate([one.forces for one in group]),
        )
        for name, group in ((name, list(members)) for name, members in groups)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--profile", default="", help="with a load; default: a high pass")
    given = parser.parse_args()
    section = ImageSection(width_px=640, height_px=480, mm_per_px=0.05)
    step = LinearForce(Options(), SensorContext(section, Gel()))
    loads = loads_of(given.profile) if given.profile else high_pass_loads
    found = [samples(clip, loads, step) for clip in sorted(given.clips.glob("*.avi"))]
    for words, clips in zip(("loading", "whole clips"), zip(*found, strict=True), strict=True):
        objects = by_object(clips)
        forces, std = held_out_forces(objects, step.fit)
        score = score_forces(objects, forces, std)["fz_n"]
        print(
            f"{words}: RMSE {score.rmse:.2f} N, {score.percent_of_range:.1f} % of the range, "
            f"R² {score.r2:.3f}, {score.within_std:.0%} within one standard deviation"
        )


if __name__ == "__main__":
    main()
