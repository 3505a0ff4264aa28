"""Virtual units calibrated with one ball and measured with others: five presses, another size.

``python experiments/other_ball.py [UNITS]`` prints, over all units, the mean error of the normal
and the radius of the fitted spheres over that of the ball. Circles are the true ones, so that only
the calibration is judged. The control is the same ball, pressed at other places.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from experiments.press_sets import HERE
from experiments.sphere import radius_px
from experiments.virtual_presses import unit_of
from experiments.virtual_unit import unit_overrides
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.result import Measured
from tactile_core.interfaces.calibration import Calibration
from tactile_core.plugins.options import calibrator_of
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Gradients, HeightMap, Reference
from tactile_sim.optics.rig import RigOptics

_SEED_STEP = 1000
"""Offset of the seed from ball to ball: each is pressed at other places."""


class Proxy(NamedTuple):
    """A kind of unit, the radii in mm of its balls, and the presses of a calibration."""

    rig: str
    balls_mm: tuple[float, ...]
    calibrated_on: int


PROXIES = {
    "another size": Proxy(str(HERE / "mini_virtual.yaml"), (3.155, 4.75), 12),
    "five presses": Proxy("hex_fingertip_unmarked", (1.98,), 5),
}
"""GelSight Mini with balls of 6.31 and 9.5 mm; hexagonal fingertip with one of 3.96 mm."""


class Errors(NamedTuple):
    """Errors on the presses of one ball: medians over the presses."""

    calibrated_mm: float
    pressed_mm: float
    normal_deg: float
    radius_ratio: float


def presses_of(proxy: Proxy, seed: int) -> tuple[Reference, dict[float, list[FoundPress]]]:
    """Press each ball all over one unit; return the unit's reference and the presses by ball."""
    overrides = unit_overrides(proxy.rig, seed)
    profile = load_profile(proxy.rig, sim=True, overrides=overrides)
    optics = RigOptics(profile, seed=seed)
    pressed = {}
    for number, ball_mm in enumerate(proxy.balls_mm):
        unit = unit_of(
            f"{proxy.rig} {seed}",
            profile,
            lambda height_mm, frame: optics.expose(height_mm, frame=frame),
            (ball_mm,),
            seed + number * _SEED_STEP,
        )
        pressed[ball_mm] = unit.found_presses(profile.gel.thickness_mm or ball_mm)
    return unit.reference, pressed


def errors(proxy: Proxy, seed: int) -> Iterator[Errors]:
    """Calibrate one unit with some presses of each ball and measure the remaining presses."""
    reference, pressed = presses_of(proxy, seed)
    calibrator = calibrator_of(load_profile(proxy.rig, sim=True).calibration)
    for ball_mm, presses in pressed.items():
        seen = presses[: proxy.calibrated_on]
        model = calibrator.fit([press.training() for press in seen], reference)
        for other_mm, others in pressed.items():
            unseen = [press for press in others if press not in seen]
            yield Errors(ball_mm, other_mm, *measured(model, unseen, reference))


def measured(
    model: Calibration, presses: Sequence[FoundPress], reference: Reference
) -> tuple[float, float]:
    """Median error of the normal in degrees, and median radius over that of the ball."""
    degrees, ratios = [], []
    for press in presses:
        slopes = model.measure(press.frame, reference)
        assert isinstance(slopes, Gradients)
        height_mm = Measured.from_quantity(slopes).height_mm
        height = HeightMap(height_mm, slopes.valid, slopes.mm_per_px)
        degrees.append(press.normal_errors_deg(slopes).mean())
        ratios.append(radius_px(height, press) / press.ball_radius_px)
    return float(np.median(degrees)), float(np.median(ratios))


def main(units: int) -> None:
    """Print a line for each proxy and pair of balls."""
    for name, proxy in PROXIES.items():
        every = [found for seed in range(units) for found in errors(proxy, seed)]
        for pair in sorted({(found.calibrated_mm, found.pressed_mm) for found in every}):
            _, _, degrees, ratios = np.transpose([found for found in every if found[:2] == pair])
            off = np.abs(ratios - 1)
            print(
                f"{name}, ball of {2 * pair[0]:g} -> {2 * pair[1]:g} mm: {degrees.mean():.2f} deg, "
                f"radius {np.median(ratios):.3f} (worst unit {ratios[off.argmax()]:.3f}, "
                f"{np.count_nonzero(off <= 0.03)} of {len(off)} within 3 %)",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
