"""The DIGIT lit at once and one colour after another: ``python experiments/digit_sequential.py``.

Virtual units of one design, each calibrated in each way on the same presses of a ball, then pressed
with other balls, cylinders and cones at other places. Prints, for each way, the error of normals in
the contact, the radius of spheres fitted to the heights over that of the ball, and the error of the
highest point; the same while the ball moves from exposure to exposure; and the signal over noise of
each way to read one LED from a colour image.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from tactile_core.acquisition.acquisition import average
from tactile_core.calibration.fitting import calibrate_presses
from tactile_core.calibration.presses import angles_deg
from tactile_core.errors import SequenceError
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Gradients, HeightMap
from tactile_sim.stage import VirtualStage, vary
from tactile_sim.truth import TrueState

AT_ONCE, SEQUENTIAL = "digit", "digit_sequential"
IMAGES = 6
"""Images at 30 Hz in the time of one observation with sequential lights."""
WAYS = {AT_ONCE: 1, f"{AT_ONCE}, mean of {IMAGES} images": IMAGES, SEQUENTIAL: 1}
"""Frames that are averaged in each way to measure; its profile comes first in its name."""
BALL_MM = 4.0
PRESSES = 14
STEPS_MM = 0.0, 0.03, 0.07, 0.15, 0.3, 0.6
"""Movement from one exposure to the next."""
LUMA = np.array([0.299, 0.587, 0.114])  # ITU-R BT.601


class Press(NamedTuple):
    """An object, its depth, and its place from the image centre."""

    kind: str
    sizes: dict[str, float]
    depth_mm: float
    x_mm: float
    y_mm: float


class Errors(NamedTuple):
    """Errors of one press; the ratios are 1 if right. ``radius`` is NaN if it is not a ball."""

    normal_deg: float
    radius: float
    peak: float


class Unit:
    """One virtual unit in one of the ways, calibrated."""

    def __init__(self, way: str, seed: int) -> None:
        self.profile = vary(load_profile(way.partition(",")[0], sim=True), seed)
        self.frames = WAYS[way]
        self.stage = VirtualStage(self.profile, seed)
        reference = average([self.stage.frame() for _ in range(10)])
        rng = np.random.default_rng([seed, 61])
        balls = (ball(rng, rng.uniform(0.12, 0.22) * BALL_MM) for _ in range(PRESSES))
        presses = {f"{number}": self.shown(one)[0] for number, one in enumerate(balls)}
        made = calibrate_presses(
            self.profile, presses, reference, ball_diameter_mm=BALL_MM, scored=False
        )
        self.pipeline = Pipeline(self.profile, made.bundle)

    def shown(self, press: Press, sideways_mm: float = 0.0) -> tuple[Frame, TrueState]:
        """Return the frame of a press and its truth."""
        self.stage.reset()
        place = {"x_mm": press.x_mm + sideways_mm, "y_mm": press.y_mm}
        self.stage.indenter(press.kind, **place, **press.sizes)
        self.stage.press(depth_mm=press.depth_mm)
        frames = [self.stage.frame() for _ in range(self.frames)]
        mean = np.rint(np.mean([frame.pixels for frame in frames], axis=0))
        pixels = mean.astype(frames[0].pixels.dtype)
        return replace(frames[0], pixels=pixels), self.stage.truth()

    def moving(self, press: Press, step_mm: float) -> tuple[Frame, TrueState]:
        """Return the frame of an object that moves to the right, and its truth half way."""
        frame, truth = self.shown(press)
        count = len(frame.channels)
        places = (np.arange(count) - (count - 1) / 2) * step_mm
        shown = [self.shown(press, far)[0].pixels[..., k] for k, far in enumerate(places)]
        return replace(frame, pixels=np.stack(shown, -1)), truth

    def errors(self, frame: Frame, truth: TrueState, press: Press) -> Errors:
        """Measure a frame."""
        reading = self.pipeline.process(frame)
        slopes, height = reading.get(Gradients), reading[HeightMap]
        found = np.stack([slopes.x, slopes.y], -1)[truth.contact]
        normal = float(angles_deg(found, truth.gradients[truth.contact]).mean())
        peak = float(height.mm[truth.contact].max() / truth.height_mm[truth.contact].max())
        return Errors(normal, _radius(height, truth, press), peak)


def ball(rng: np.random.Generator, depth_mm: float, diameter_mm: float = BALL_MM) -> Press:
    """Return a press of a ball at a random place."""
    x, y = rng.uniform(-1, 1, 2) * (4.0, 6.0)  # mm, of a view of 12.9 x 17.2 mm
    return Press("sphere", {"diameter_mm": diameter_mm}, float(depth_mm), float(x), float(y))


def others(seed: int) -> Iterator[Press]:
    """Yield objects that were not used in the calibration, at other places."""
    rng = np.random.default_rng([seed, 62])
    for diameter_mm in (3.0, 4.0, 5.0, 6.0):
        yield ball(rng, 0.15 * diameter_mm, diameter_mm)
    for kind, sizes in (
        ("cylinder", {"diameter_mm": 4.0, "length_mm": 6.0}),
        ("cone", {"diameter_mm": 5.0, "angle_deg": 130.0}),
    ):
        x, y = rng.uniform(-1, 1, 2) * (2.5, 4.0)
        yield Press(kind, sizes, 0.5, float(x), float(y))


def _radius(height: HeightMap, truth: TrueState, press: Press) -> float:
    """Radius of a sphere fitted to the height in the contact, over the ball's."""
    if press.kind != "sphere":
        return float("nan")
    radius = press.sizes["diameter_mm"] / 2
    rows, columns = np.nonzero(truth.contact)
    mm = height.mm_per_px
    x, y = (columns - columns.mean()) * mm, (rows - rows.mean()) * mm
    inner = np.hypot(x, y) < min(0.65 * radius, 0.95 * np.hypot(x, y).max())
    x, y, z = x[inner], y[inner], height.mm[truth.contact][inner]

    def residual(t: np.ndarray) -> np.ndarray:
        square = t[3] ** 2 - (x - t[0]) ** 2 - (y - t[1]) ** 2
        return np.asarray(t[2] + np.sqrt(np.maximum(square, 1e-3)) - z)

    start = [0.0, 0.0, float(z.max()) - radius, radius]
    return float(least_squares(residual, start, loss="soft_l1", f_scale=0.02).x[3] / radius)


def summary(errors: list[Errors]) -> str:
    """Mean error of normals, radius in the median and its worst, error of the peak."""
    normal, radius, peak = np.array(errors).T
    off = np.abs(peak - 1)
    radius = radius[np.isfinite(radius)]
    spheres = f"sphere {np.median(radius):.3f} (5 % {np.quantile(radius, 0.05):.3f}, "
    spheres += f"95 % {np.quantile(radius, 0.95):.3f})" if len(radius) else ""
    return (
        f"normals {normal.mean():5.2f} deg, {spheres}, peak off by {np.median(off):.1%} "
        f"(95 % {np.quantile(off, 0.95):.1%})"
    )


def signal_over_noise(seed: int) -> dict[str, np.ndarray]:
    """Signal over noise of each LED, in its own colour, in the luma and in the best sum.

    The signal is the standard deviation in the contact of a ball, the noise that of two images.
    """
    profile = vary(load_profile(SEQUENTIAL, sim=True), seed)
    stage = VirtualStage(profile, seed)
    first, second = (np.array(stage.exposures(), np.float64) for _ in range(2))
    stage.indenter("sphere", diameter_mm=BALL_MM)
    stage.press(depth_mm=0.15 * BALL_MM)
    contact = stage.truth().contact
    change = (np.array(stage.exposures()) - first)[:, contact]  # (lights, N, colours)
    noise = (second - first)[:, contact] / np.sqrt(2)

    def ratio(weights: np.ndarray, rounding: float = 0.0) -> np.ndarray:
        signal, lost = (np.einsum("lnc,lc->ln", one, weights) for one in (change, noise))
        return np.asarray(signal.std(1) / np.sqrt(lost.var(1) + rounding))

    best = change.std(1) / noise.var(1)
    return {
        "own colour": ratio(np.eye(3)),
        "luma": ratio(np.tile(LUMA, (3, 1)), rounding=1 / 12),  # variance of a rounded sum
        "best sum": ratio(best / best.max(axis=1, keepdims=True)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(20, 28)))
    options = parser.parse_args()
    found = [signal_over_noise(seed) for seed in options.seeds]
    for name in found[0]:
        values = np.mean([one[name] for one in found], axis=0)
        print(f"signal over noise, {name}: red, green, blue {np.round(values, 1)}", flush=True)
    still: dict[str, list[Errors]] = {way: [] for way in WAYS}
    moved: dict[float, list[Errors]] = {step: [] for step in STEPS_MM}
    refused = dict.fromkeys(STEPS_MM, 0)
    for seed in options.seeds:
        for way, errors in still.items():
            unit = Unit(way, seed)
            mine = [unit.errors(*unit.shown(press), press) for press in others(seed)]
            errors += mine
            print(f"seed {seed} {way:25}: {summary(mine)}", flush=True)
            for step in STEPS_MM if way == SEQUENTIAL else ():
                for press in (one for one in others(seed) if one.kind == "sphere"):
                    try:
                        moved[step].append(unit.errors(*unit.moving(press, step), press))
                    except SequenceError:
                        refused[step] += 1
    for way, errors in still.items():
        print(f"{way}: {summary(errors)}")
        balls = [one for one in errors if np.isfinite(one.radius)]
        print(f"{way}, balls: {summary(balls)}")
    for step, errors in moved.items():
        print(f"balls, {step:g} mm between exposures: {summary(errors)}; {refused[step]} refused")


if __name__ == "__main__":
    main()
