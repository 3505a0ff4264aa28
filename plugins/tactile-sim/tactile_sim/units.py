"""``sim.virtual``: virtual units of any profile, for who knows only the interface."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.simulator import Renderer, Simulator
from tactile_sim.optics.rig import RigOptics
from tactile_sim.simulation import write_frame
from tactile_sim.stage import VirtualStage


class VirtualUnits(Simulator):
    """Renders height maps, and presses balls into virtual gels."""

    def renderer(self, build: SensorBuild, *, seed: int = 0) -> Renderer:
        """Return the optics of a unit."""
        return RigOptics(build, seed=seed)

    def write_presses(self, build: SensorBuild, folder: Path, *, count: int) -> float:
        """Press a ball at random places of the image, not too near its border."""
        return press_balls(VirtualStage(build), folder, count=count)


def press_balls(stage: VirtualStage, folder: Path, *, count: int) -> float:
    """Press a ball repeatedly; write ``folder/presses`` and ``folder/reference``.

    Returns
    -------
    float
        Diameter of the ball, mm.
    """
    rng = np.random.default_rng(7)
    diameter_mm = ball_diameter_mm(stage.profile)
    write_frame(folder / "reference", stage.frame(), "undeformed")
    for number in range(count):
        x, y = rng.uniform(-0.38, 0.38, 2)  # shares of the image
        depth_mm = float(rng.uniform(0.12, 0.22)) * diameter_mm
        put_object(stage, "sphere", float(x), float(y), diameter_mm=diameter_mm)
        stage.press(depth_mm=depth_mm)
        write_frame(folder / "presses", stage.frame(), f"press_{number:02d}")
    return diameter_mm


def put_object(
    stage: VirtualStage, kind: str, x: float, y: float, angle_deg: float = 0.0, **sizes_mm: float
) -> None:
    """Place an object over an undeformed gel; x and y are shares of the image from its centre."""
    image = stage.profile.image
    stage.reset()
    stage.indenter(
        kind,
        x_mm=x * image.width_px * image.mm_per_px,
        y_mm=y * image.height_px * image.mm_per_px,
        angle_deg=angle_deg,
        **sizes_mm,
    )


def ball_diameter_mm(build: SensorBuild) -> float:
    """Return the diameter of a ball for the calibration of a sensor, mm."""
    view_mm = build.image.width_px * build.image.mm_per_px
    most_mm = 2 * (build.gel.thickness_mm or view_mm)  # a larger ball reaches through the gel
    return round(min(0.22 * view_mm, most_mm), 2)
