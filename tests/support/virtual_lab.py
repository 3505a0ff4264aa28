"""A small virtual sensor with recordings on disk and a bundle, for end-to-end tests."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.calibration.fitting import calibrate
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim.optics.rig import render


@dataclass(frozen=True)
class VirtualLab:
    """A small virtual sensor: its profile, its recordings on disk, and its bundle."""

    folder: Path
    profile_path: Path
    profile: Profile
    bundle: Path

    @property
    def presses(self) -> Path:
        return self.folder / "presses"

    @property
    def reference(self) -> Path:
        return self.folder / "reference.png"

    def image(self, press: BallPress | None, seed: int = 99) -> NDArray[np.uint8]:
        """Render an image."""
        section = self.profile.image
        shape = (section.height_px, section.width_px)
        height = np.zeros(shape) if press is None else press.height_mm(shape, section.mm_per_px)
        return render(self.profile, height, seed=seed)

    def save(self, path: Path, press: BallPress | None, seed: int = 99) -> Path:
        """Render an image and write it."""
        path.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path), self.image(press, seed)[..., ::-1])
        return path


PROFILE = """\
schema: 1
name: virtual_lab
description: A small virtual sensor
image: {width_px: 160, height_px: 120, mm_per_px: 0.1245}
illumination:
  use: core.constant
  lights:
    - {name: red, azimuth_deg: 90, elevation_deg: 35}
    - {name: green, azimuth_deg: 210, elevation_deg: 35}
    - {name: blue, azimuth_deg: 330, elevation_deg: 35}
optics:                        # wide, soft lights, almost without shadows
  lights: {distance_mm: 40, scatter: 1.0}
  sensor: {jpeg_quality: none}
calibration: {use: core.automatic}
estimators:
  height: {use: core.poisson}
  contact: {use: core.contact}
"""
BALL_MM = 4.0


def make_lab(folder: Path) -> VirtualLab:
    """Render ten presses of a ball, calibrate on them and save the bundle."""
    path = folder / "virtual_lab.yaml"
    path.write_text(PROFILE)
    made = VirtualLab(folder, path, load_profile(path), folder / "bundle")
    rng = np.random.default_rng(3)
    for i in range(10):
        centre = (float(rng.uniform(25, 135)), float(rng.uniform(25, 95)))
        made.save(made.presses / f"press_{i}.png", BallPress(centre, BALL_MM, 0.8), seed=i)
    made.save(made.reference, None)
    result = calibrate(
        made.profile, made.presses, made.reference, ball_diameter_mm=BALL_MM, serial="0007"
    )
    result.save(made.bundle)
    return made
