"""Grooves on virtual units calibrated with a ball: ``python experiments/groove_virtual.py``.

The gel follows each groove exactly. The walls are steeper than nearly all slopes of the calibration
presses, so that the model extrapolates. Prints, for six sequential lights and for four colours at
once, the measured depth over the true one. ``--shallow`` halves the slope of the walls: a control
that needs no extrapolation.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.virtual_presses import unit_of
from experiments.virtual_unit import unit_overrides
from tactile_core.calibration.result import Measured
from tactile_core.interfaces.calibration import Calibration
from tactile_core.plugins.options import calibrator_of
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Gradients, Reference
from tactile_sim.optics.rig import RigOptics

Array = NDArray[Any]

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
RIGS = {
    "six LEDs": "desktop_six_led",
    "four colours": str(EXAMPLES / "four_colour.yaml"),
}
IMAGE = {"width_px": 616, "height_px": 514, "mm_per_px": 0.0274581}
"""That of ``six_led/groove``."""

BALL_MM = 1.6
"""Radius of the ball."""


class Groove(NamedTuple):
    """A straight groove with sloped walls.

    Attributes
    ----------
    depth_mm, floor_mm
        Depth, and width of the floor.
    wall_deg
        Angle between wall and surface.
    direction_deg, offset_mm
        Direction of its normal from x towards y, and distance of its middle from the image centre.
    """

    depth_mm: float
    floor_mm: float
    wall_deg: float
    direction_deg: float
    offset_mm: float

    @classmethod
    def drawn(cls, rng: np.random.Generator, shallow: bool) -> Groove:
        """Draw a groove of 0.5 mm with walls like those of ``six_led/groove``."""
        wall_deg = float(rng.uniform(35, 45))
        if shallow:
            wall_deg = float(np.degrees(np.arctan(np.tan(np.radians(wall_deg)) / 2)))
        return cls(
            0.5,
            float(rng.uniform(0.8, 1.6)),
            wall_deg,
            float(rng.uniform(0, 180)),
            float(rng.uniform(-3, 3)),
        )

    @property
    def half_mm(self) -> float:
        """Half of its width at the surface."""
        return self.floor_mm / 2 + self.depth_mm / np.tan(np.radians(self.wall_deg))

    def across_mm(self, profile: Profile) -> Array:
        """(H, W) distance from the middle of the groove."""
        image = profile.image
        y, x = np.indices((image.height_px, image.width_px), np.float64)
        x -= (image.width_px - 1) / 2
        y -= (image.height_px - 1) / 2
        angle = np.radians(self.direction_deg)
        return (x * np.cos(angle) + y * np.sin(angle)) * image.mm_per_px - self.offset_mm

    def height_mm(self, profile: Profile) -> Array:
        """(H, W) height of the gel; the groove lets it bulge out, so its floor is negative."""
        slope = np.tan(np.radians(self.wall_deg))
        depth = np.clip((self.half_mm - np.abs(self.across_mm(profile))) * slope, 0, self.depth_mm)
        return cv2.GaussianBlur(-depth, (0, 0), 1.0)

    def depth_over_true(self, height_mm: Array, profile: Profile) -> float:
        """Depth of the groove in a height map, over the true one."""
        across = np.abs(self.across_mm(profile))
        floor = across < self.floor_mm / 4
        shoulder = (across > self.half_mm + 0.15) & (across < self.half_mm + 0.4)
        depth_mm = np.median(height_mm[shoulder]) - np.median(height_mm[floor])
        return float(depth_mm / self.depth_mm)


def ratios(rig: str, seed: int, shallow: bool, grooves: int = 3) -> list[float]:
    """Calibrate one unit and measure grooves."""
    overrides = {"image": IMAGE, **unit_overrides(rig, seed)}
    profile = load_profile(rig, sim=True, overrides=overrides)
    optics = RigOptics(profile, seed=seed)
    rng = np.random.default_rng([23, seed])
    grooved = [Groove.drawn(rng, shallow) for _ in range(grooves)]
    heights = [groove.height_mm(profile) for groove in grooved]
    unit = unit_of(
        rig,
        profile,
        lambda height_mm, number: optics.expose(height_mm, frame=number),
        (BALL_MM,),
        seed,
    )
    found = unit.found_presses(profile.gel.thickness_mm or BALL_MM)
    model = calibrator_of(profile.calibration).fit([f.training() for f in found], unit.reference)
    result = []
    for number, (groove, height_mm) in enumerate(zip(grooved, heights, strict=True)):
        frame = unit.expose(height_mm, 20_000 + number)
        result.append(groove.depth_over_true(_height(model, frame, unit.reference), profile))
    return result


def _height(model: Calibration, frame: Frame, reference: Reference) -> Array:
    slopes = model.measure(frame, reference)
    assert isinstance(slopes, Gradients)
    return Measured.from_quantity(slopes).height_mm


def main() -> None:
    """Print a line for each rig."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=20)
    parser.add_argument("--shallow", action="store_true")
    options = parser.parse_args()
    for name, rig in RIGS.items():
        every = np.array([ratios(rig, seed, options.shallow) for seed in range(options.units)])
        off = np.abs(every - 1)
        print(
            f"{name}: {every.size} grooves on {options.units} units, depth over true: median "
            f"{np.median(every):.3f}, worst {every.flat[off.argmax()]:.3f}, median error "
            f"{np.median(off):.1%}, {np.count_nonzero(off <= 0.02)} within 2 %, "
            f"{np.count_nonzero(off <= 0.03)} within 3 %",
            flush=True,
        )


if __name__ == "__main__":
    main()
