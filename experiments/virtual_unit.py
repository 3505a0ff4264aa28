"""Virtual units of a rig that differ in light, gel and camera, calibrated with the defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tactile_core.calibration.fitting import calibrate
from tactile_core.errors import InputError
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import HeightMap
from tactile_sim.simulation import write_frame
from tactile_sim.stage import VirtualStage
from tactile_sim.truth import TrueState

BALL_SHARE = 0.22
"""Diameter of the calibration ball, in view widths; at most two gel thicknesses."""
PRESSES = 12
REACH = 0.4
"""Largest distance of a calibration press from the image centre, in view sizes."""


@dataclass(frozen=True)
class Pressed:
    """An object to press; sizes and depth in diameters of the calibration ball, place in views."""

    label: str
    kind: str
    sizes: Mapping[str, float]
    depth: float
    x: float
    y: float
    angle_deg: float = 0.0


def unit_overrides(rig: str, seed: int) -> dict[str, Any]:
    """Profile keys of a unit: seed 0 is the profile itself, others vary around it."""
    if seed == 0:
        return {}
    profile = load_profile(rig, sim=True)
    rng = np.random.default_rng(seed)
    optics, thickness = profile.optics, profile.gel.thickness_mm or 2.0
    distance = optics.lights.distance_mm or 0.8 * view_mm(rig)
    return {
        "gel": {"thickness_mm": thickness * float(rng.uniform(0.8, 1.3))},
        "optics": {
            "lights": {
                "distance_mm": distance * float(rng.uniform(0.85, 1.2)),
                "lobe_deg": min(170.0, optics.lights.lobe_deg * float(rng.uniform(0.8, 1.25))),
                "spread": float(rng.uniform(0, 0.25)),
            },
            "ambient": optics.ambient * float(rng.uniform(0.7, 1.3)),
            "sensor": {"exposure": optics.sensor.exposure * float(rng.uniform(0.75, 1.1))},
        },
    }


def view_mm(rig: str) -> float:
    """Width of the view."""
    image = load_profile(rig, sim=True).image
    return image.width_px * image.mm_per_px


class VirtualUnit:
    """A calibrated virtual unit that measures presses.

    Parameters
    ----------
    rig : str
        Name of a profile.
    seed : int
        Of the unit's grain and noise, and of the places of the calibration presses.
    overrides : mapping
        Profile keys of the unit.
    believed : float
        Thickness of the gel that the profile says, over the true one.
    """

    def __init__(
        self, rig: str, seed: int, overrides: Mapping[str, Any], *, believed: float = 1.0
    ) -> None:
        self.stage = VirtualStage(rig, seed, overrides=dict(overrides))
        profile = self.stage.profile
        image = profile.image
        self.view_mm = np.array([image.width_px, image.height_px]) * image.mm_per_px
        thickness_mm = profile.gel.thickness_mm or self.view_mm[0]
        self.ball_mm = round(float(min(BALL_SHARE * self.view_mm[0], 2 * thickness_mm)), 2)
        says = {**overrides, "gel": {**overrides.get("gel", {})}}
        says["gel"]["thickness_mm"] = believed * thickness_mm
        loaded = load_profile(rig, sim=True, overrides=says)
        rng = np.random.default_rng([7, seed])
        with TemporaryDirectory(prefix="virtual-unit-") as name:
            folder = Path(name)
            write_frame(folder / "reference", self.stage.frame(), "undeformed")
            for number in range(PRESSES):
                x, y = rng.uniform(-REACH, REACH, 2)
                depth = float(rng.uniform(0.12, 0.22))
                self.press(Pressed("", "sphere", {"diameter_mm": 1.0}, depth, x, y))
                write_frame(folder / "presses", self.stage.frame(), f"press_{number:02d}")
            made = calibrate(
                loaded,
                folder / "presses",
                folder / "reference",
                ball_diameter_mm=self.ball_mm,
                scored=False,
            )
        self.pipeline = Pipeline(loaded, made.bundle)

    def press(self, pressed: Pressed) -> None:
        """Press an object."""
        self.stage.reset()
        sizes = {name: size * self.ball_mm for name, size in pressed.sizes.items()}
        x_mm, y_mm = np.array([pressed.x, pressed.y]) * self.view_mm
        place = {"x_mm": float(x_mm), "y_mm": float(y_mm), "angle_deg": pressed.angle_deg}
        self.stage.indenter(pressed.kind, **place, **sizes)
        self.stage.press(depth_mm=pressed.depth * self.ball_mm)

    def measured(self, pressed: Pressed | None) -> tuple[HeightMap, TrueState] | None:
        """Measure an object, or the undeformed gel; None if the object misses the view."""
        self.stage.reset()
        try:
            if pressed is not None:
                self.press(pressed)
        except InputError:
            return None
        truth = self.stage.truth()
        if pressed is not None and not truth.contact.any():
            return None
        return self.pipeline.process(self.stage.frame())[HeightMap], truth
