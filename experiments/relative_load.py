"""The load without calibration: ``python experiments/relative_load.py [DATA]``.

With recordings: Pearson's correlation of ``core.load`` with the labelled force while the force of
each recorded grip rises to its maximum, beside halved and doubled scales and simpler methods.
Without them: virtual rigs at rest, under lights of another brightness, and under rising forces.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from experiments.virtual_unit import unit_overrides
from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.force.elastic_layer import POISSON_RATIO, SHEAR_MODULUS_MPA, Elastomer
from tactile_core.algorithms.light.light_change import LIGHT_CHANGE, change_in_detail
from tactile_core.builtin.contact import THICKNESS_SHARE
from tactile_core.errors import InputError
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Reference, RelativeLoad
from tactile_sim.stage import VirtualStage

PROFILE = Path(__file__).with_name("profiles") / "grip_wedge.yaml"
CLIPPED_N = 40.0
"""The labels reach 25 N; a glitch above this takes the value before it."""
ONSET = 0.02
"""The force rises from the last frame in which it is less than this share of its maximum."""

AT_REST = 200
"""Frames at rest."""
FORCES_N = 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.5, 0.75, 1.0, 2.0, 4.0, 8.0
SHAPES: tuple[tuple[str, dict[str, float]], ...] = (
    ("sphere", {"diameter_mm": 4}),
    ("sphere", {"diameter_mm": 12}),
    ("sphere", {"diameter_mm": 30}),
    ("cylinder", {"diameter_mm": 10, "length_mm": 8}),
    ("flat", {"diameter_mm": 4}),
    ("flat", {"diameter_mm": 8}),
)
ONLY_LOAD = {"load": {"use": "core.load"}}

Method = Callable[[Array, Array], float]


class Clip(NamedTuple):
    """One grip up to its largest force: frames after conditioning, loads, and forces in N."""

    name: str
    frames: list[Array]
    reference: Array
    loads: Array
    force_n: Array

    @property
    def onset(self) -> int:
        """First frame of the rise."""
        weak = np.flatnonzero(self.force_n < ONSET * self.force_n.max())
        return int(weak[-1]) if len(weak) else 0


def clips(data: Path, name: str = "*") -> list[Clip]:
    """Measure every clip of this name relative to its first frame."""
    found = []
    for video in sorted((data / "force" / "grip").glob(f"{name}.avi")):
        with video.with_name(f"{video.stem}_labels.csv").open() as file:
            force_n = np.array([float(row["force_N"]) for row in csv.DictReader(file)])
        for number in np.flatnonzero(force_n > CLIPPED_N):
            force_n[number] = force_n[number - 1] if number else 0.0
        count = int(force_n.argmax()) + 1
        with open_sensor(PROFILE, input=video, reference="first") as sensor:
            readings = [reading for reading, _ in zip(sensor.stream(), range(count), strict=False)]
        frames = [reading.frame.pixels for reading in readings]
        loads = np.array([reading[RelativeLoad].load for reading in readings])
        reference = frames[0].astype(np.float32)
        found.append(Clip(video.stem, frames, reference, loads, force_n[:count]))
    return found


def correlations(clip: Clip, loads: Array) -> tuple[float, float]:
    """Return that of the rise, and that of all frames up to the largest force."""
    rise = slice(clip.onset, None)
    return (
        float(np.corrcoef(loads[rise], clip.force_n[rise])[0, 1]),
        float(np.corrcoef(loads, clip.force_n)[0, 1]),
    )


def methods() -> dict[str, Method]:
    """Return the method with other scales, and what is simpler."""
    base = LIGHT_CHANGE
    share = THICKNESS_SHARE

    def scaled(name: str, factor: float) -> Method:
        fields = ("cells_per_thickness", "cells_per_width") if name == "cells" else (name,)
        changed = base._replace(**{field: getattr(base, field) * factor for field in fields})
        return lambda now, before: change_in_detail(
            now, before, None, share * before.shape[1], changed
        )

    found: dict[str, Method] = {"as it is": scaled("cells", 1)}
    for name in ("cells", "kept_thicknesses", "lit_share"):
        found |= {f"{name} × {factor:g}": scaled(name, factor) for factor in (0.5, 2)}
    found["difference, high-pass"] = lambda now, before: _high_pass(now, before, share)
    found["difference"] = lambda now, before: float(np.abs(now - before).mean())
    found["mean brightness"] = lambda now, before: float(now.mean())
    return found


def _high_pass(now: Array, before: Array, share: float) -> float:
    """Root mean square of the high-pass difference, without what treats noise and lights."""
    change = now - before
    sigma = LIGHT_CHANGE.kept_thicknesses * share * before.shape[1]
    return float(np.sqrt(np.mean((change - cv2.GaussianBlur(change, (0, 0), sigma)) ** 2)))


def recorded(data: Path) -> None:
    """Print the tables of the recorded grips."""
    taken = clips(data)
    print("clip: correlation in the rise, in all frames; frames in the rise; best shift of labels")
    for clip in taken:
        rise, every = correlations(clip, clip.loads)
        count = len(clip.loads) - clip.onset
        print(f"{clip.name:24s} {rise:.4f} {every:.4f} {count:3d} {_shift(clip):+d}")
    scored = np.array([correlations(clip, clip.loads) for clip in taken])
    print("method: median, worst in the rise; median, worst in all frames")
    print(_line("core.load", scored))
    for name, method in methods().items():
        loads = [
            np.array([method(frame, clip.reference) for frame in clip.frames]) for clip in taken
        ]
        found = [correlations(clip, load) for clip, load in zip(taken, loads, strict=True)]
        print(_line(name, np.array(found)), flush=True)


def _line(name: str, scored: Array) -> str:
    middle, worst = np.median(scored, axis=0), scored.min(axis=0)
    return f"{name:24s} {middle[0]:.4f} {worst[0]:.4f} | {middle[1]:.4f} {worst[1]:.4f}"


def _shift(clip: Clip) -> int:
    """Frames by which the labels would have to be moved forwards to correlate best."""
    loads, force_n = clip.loads, clip.force_n
    tried = {}
    for shift in range(-5, 6):
        here = slice(max(0, -shift), len(loads) - max(0, shift))
        there = slice(max(0, shift), len(loads) + min(0, shift))
        tried[shift] = np.corrcoef(loads[here], force_n[there])[0, 1]
    return max(tried, key=lambda shift: float(tried[shift]))


def response(waves: Sequence[float] = (0.125, 0.25, 0.5, 1, 1.5, 2, 4, 8)) -> None:
    """Print the slope per pressure of a bonded layer, and the share of a wave that is kept."""
    wave = np.array(waves, np.float64)
    slope = wave * Elastomer(1.0, SHEAR_MODULUS_MPA, POISSON_RATIO).compliance(wave).normal
    kept = 1 - np.exp(-((wave * LIGHT_CHANGE.kept_thicknesses) ** 2) / 2)
    print("wave number times thickness: slope of a bonded layer over a half-space's; kept share")
    for one, of_layer, share in zip(wave, slope / slope[-1], kept, strict=True):
        print(f"  {one:5g}: {of_layer:.2f}  {share:.2f}")


def merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested keys of both; the second wins."""
    found = dict(one)
    for key, value in other.items():
        both = isinstance(value, Mapping) and isinstance(found.get(key), Mapping)
        found[key] = merged(found[key], value) if both else value
    return found


def virtual(rig: str, seed: int) -> None:
    """Print the loads of one virtual unit, and the least force that it distinguishes from none."""
    overrides = unit_overrides(rig, seed)
    stage = VirtualStage(rig, seed, overrides=overrides)
    profile = load_profile(rig, sim=True, overrides={**overrides, "estimators": ONLY_LOAD})
    before = [stage.frame() for _ in range(10)]
    pixels = np.asarray(np.mean([frame.pixels for frame in before], axis=0), np.float32)
    reference = Reference(pixels, before[0].channels, before[0].full_scale, frames=len(before))
    pipeline = Pipeline(profile, reference=reference)

    def load(frame: Frame) -> float:
        return pipeline.process(frame)[RelativeLoad].load

    rest = np.array([load(stage.frame()) for _ in range(AT_REST)])
    border, std = float(np.quantile(rest, 0.99)), float(rest.std())
    print(f"{rig} {seed}: at rest {rest.mean():.5f} ± {std:.5f}, 99 % below {border:.5f}")
    exposure = stage.profile.optics.sensor.exposure
    for gain in (0.9, 1.1):
        sensor = {"optics": {"sensor": {"exposure": gain * exposure}}}
        other = VirtualStage(rig, seed, overrides=merged(overrides, sensor))
        lit = np.mean([load(other.frame()) for _ in range(3)])
        print(f"  light × {gain}: {lit:.5f}")
    for kind, sizes in SHAPES:
        stage.reset()
        stage.indenter(kind, **sizes)
        loads, pressed_n = [], []
        for force_n in FORCES_N:
            try:
                stage.press(force_n=force_n)
            except InputError:
                break
            pressed_n.append(float(stage.truth().wrench[2]))
            loads.append(float(np.median([load(stage.frame()) for _ in range(3)])))
        found = np.array(loads)
        below = np.flatnonzero(found <= border)
        first = int(below[-1]) + 1 if len(below) else 0
        least = f"{pressed_n[first]:.3g} N" if first < len(found) else "none"
        falls = int(np.count_nonzero(np.diff(found) < -3 * std))
        at_1n = float(np.interp(1.0, pressed_n, found))
        together = np.corrcoef(found, pressed_n)[0, 1]
        size = " ".join(f"{value:g}" for value in sizes.values())
        print(
            f"  {kind:8s} {size:5s} mm: least force {least:8s} falls {falls}, "
            f"load at 1 N {at_1n:.4f}, correlation {together:.3f}",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, nargs="?", help="recordings; without, virtual rigs")
    parser.add_argument("--rigs", nargs="+", default=["hex_fingertip", "baxter_fingertip"])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    given = parser.parse_args()
    response()
    if given.data is not None:
        recorded(given.data)
        return
    for rig in given.rigs:
        for seed in given.seeds:
            virtual(rig, seed)


if __name__ == "__main__":
    main()
