"""Depth from darkness: one press of a ball calibrates a 9DTact, and virtual units of it.

``python -m experiments.darkness [DATA]``. The real sensor: its only press, of a ball of 4.0 mm
radius, against the ball and against the depths of the authors' program, as rectified by them and
by the profile; and calibrated on one half of the contact, the other half against the same ball.
Virtual units: calibrated on one press and on four, then balls of other sizes, at other places,
against the truth in their contacts.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from experiments.press_sets import ROOT
from tactile_9dtact.darkness import DarknessCalibrator, DarknessOptions
from tactile_9dtact.depth_table import DepthTableImporter
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate, calibrate_presses
from tactile_core.calibration.presses import FoundPress
from tactile_core.interfaces.calibration import Press
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Bool, Float32, Frame, HeightMap, Reference
from tactile_sim import VirtualStage

BALL_MM = 8.0
WITHIN_MM = 3.0  # [mm] Radius around the press in which heights are compared: the gel's on the ball

UNITS: tuple[Mapping[str, Any], ...] = (
    {},
    {"coat": {"absorption_per_mm": 1.0}},
    {"sensor": {"vignetting": 0.4}},
)
PRESSES_MM = [
    (8.0, 1.0, -0.5, 1.2),
    (8.0, -4.0, 2.0, 0.9),
    (8.0, 4.0, 3.0, 1.4),
    (8.0, -2.0, -3.0, 0.6),
]
OTHERS_MM = [
    (8.0, -2.0, 1.5, 1.2),
    (5.0, 3.0, -2.0, 0.8),
    (12.0, -4.0, -1.0, 0.7),
    (3.0, 0.0, 3.0, 0.5),
]


def main() -> None:
    """Print what is measured."""
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data"
    folder = data / "ninedtact" / "sensor_1"
    for name, images in (("rectified", "rectify_crop_"), ("camera", "")):
        height, program = real_press(folder, images)
        ball, depth_mm, near = against_ball(height)
        other = rms((height - program)[near])
        print(
            f"real, {name}: {ball:.3f} mm from the ball, {depth_mm:.2f} mm deep; "
            f"{other:.3f} mm from the authors' program"
        )
    halves = held_out_mm(folder / "depth_calibration")
    print(f"real, the other half: {np.mean(halves):.3f} mm, at most {max(halves):.3f} mm")
    for unit in UNITS:
        for count in (1, len(PRESSES_MM)):
            errors = virtual_unit(unit, count)
            words = ", ".join(f"{error:.3f}" for error in errors)
            print(f"virtual, {dict(unit) or 'as the profile'}, presses: {count}: {words} mm")


def real_press(folder: Path, images: str) -> tuple[Float32, Float32]:
    """Return the heights by one press, and those of the authors' program, of that press."""
    pictures = folder / "depth_calibration"
    press, undeformed = (pictures / f"{images}{name}.png" for name in ("sample", "ref"))
    made = calibrate("9dtact", press, undeformed, ball_diameter_mm=BALL_MM, scored=False)
    (frame,) = read_frames(load_profile("9dtact"), press)
    return heights(made.bundle, frame), program_mm(folder)


def held_out_mm(pictures: Path) -> list[float]:
    """Return the deviation of one half of the contact from the ball that the other half shows."""
    press, undeformed = (pictures / f"rectify_crop_{name}.png" for name in ("sample", "ref"))
    made = calibrate("9dtact", press, undeformed, ball_diameter_mm=BALL_MM, scored=False)
    (found,), reference = made.presses, made.bundle.reference
    assert isinstance(found, FoundPress)
    assert reference is not None
    sample = found.training()
    on_ball = sample.gradients.any(axis=1)
    x, y = (sample.columns - found.centre_px[0]), (sample.rows - found.centre_px[1])
    errors = []
    for angle in np.arange(8) * np.pi / 4:
        half = on_ball & (x * np.cos(angle) + y * np.sin(angle) > 0)
        model = DarknessCalibrator(DarknessOptions()).fit([part_of(sample, half)], reference)
        height = model.measure(sample.frame, reference).mm
        ball = fitted_ball(height, sample.columns[half], sample.rows[half])
        other = on_ball & ~half
        errors.append(rms(off_ball(ball, height, sample.columns[other], sample.rows[other])))
    return errors


def part_of(press: Press, some: Bool) -> Press:
    """Return some pixels of a press."""
    assert press.heights_mm is not None
    return Press(
        press.frame,
        press.rows[some],
        press.columns[some],
        press.gradients[some],
        press.name,
        press.heights_mm[some],
    )


def program_mm(folder: Path) -> Float32:
    """Return the heights of the authors' program."""
    profile = load_profile("9dtact")
    pictures = folder / "depth_calibration"
    frame, undeformed = (
        next(iter(read_frames(profile, pictures / f"rectify_crop_{name}.png")))
        for name in ("sample", "ref")
    )
    reference = Reference(undeformed.pixels.astype(np.float32), undeformed.channels)
    return DepthTableImporter().read(folder, profile).measure(frame, reference).mm


def heights(bundle: Bundle, frame: Frame) -> Float32:
    """Return the heights of a frame."""
    return Pipeline(load_profile("9dtact"), bundle).process(frame)[HeightMap].mm


def against_ball(height: Float32) -> tuple[float, float, Bool]:
    """Return the deviation from a ball at the best place and depth, the depth, and the pixels."""
    rows, columns = np.nonzero(height > 0.5 * height.max())
    y, x = np.indices(height.shape)
    near = np.hypot(x - columns.mean(), y - rows.mean()) * mm_per_px() < WITHIN_MM
    rows, columns = np.nonzero(near)
    ball = fitted_ball(height, columns, rows)
    return rms(off_ball(ball, height, columns, rows)), float(ball[2]), near


def fitted_ball(height: Float32, columns: NDArray[Any], rows: NDArray[Any]) -> NDArray[Any]:
    """Return x, y and depth in mm of the ball that is nearest to some pixels."""
    start = [columns.mean() * mm_per_px(), rows.mean() * mm_per_px(), float(height.max())]
    return np.asarray(least_squares(off_ball, start, args=(height, columns, rows)).x)


def off_ball(
    ball: NDArray[Any], height: Float32, columns: NDArray[Any], rows: NDArray[Any]
) -> NDArray[Any]:
    """Return the ball's less the measured height at some pixels, mm."""
    x, y, depth = ball
    square = (columns * mm_per_px() - x) ** 2 + (rows * mm_per_px() - y) ** 2
    return np.sqrt((BALL_MM / 2) ** 2 - square) - BALL_MM / 2 + depth - height[rows, columns]


@cache
def mm_per_px() -> float:
    """Return the scale of the profile."""
    return load_profile("9dtact").image.mm_per_px


def virtual_unit(optics: Mapping[str, Any], count: int) -> list[float]:
    """Return the errors in the contacts of other balls."""
    stage = VirtualStage("9dtact", overrides={"optics": optics})
    undeformed = stage.frame()
    reference = Reference(undeformed.pixels.astype(np.float32), undeformed.channels)
    made = calibrate_presses(
        stage.profile,
        {f"{number}": put(stage, one) for number, one in enumerate(PRESSES_MM[:count])},
        reference,
        ball_diameter_mm=BALL_MM,
        scored=False,
    )
    pipeline = Pipeline(stage.profile, made.bundle, reference)
    errors = []
    for one in OTHERS_MM:
        measured = pipeline.process(put(stage, one))[HeightMap].mm
        truth = stage.truth()
        errors.append(rms((measured - truth.height_mm)[truth.contact]))
    return errors


def put(stage: VirtualStage, press_mm: Sequence[float]) -> Frame:
    """Press a ball of some diameter at x and y by some depth."""
    diameter, x, y, depth = press_mm
    stage.reset()
    stage.indenter("sphere", diameter_mm=diameter, x_mm=x, y_mm=y)
    stage.press(depth_mm=depth)
    return stage.frame()


def rms(error: NDArray[Any]) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(error**2)))


if __name__ == "__main__":
    main()
