"""Images of virtual sensors for the tests of the scaffold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim.optics.rig import render


def sensor(parent: str = "hex_fingertip_unmarked", **overrides: Any) -> Profile:
    """A small sensor that differs from a shipped one; its soft lights cast no shadows."""
    image = {"width_px": 160, "height_px": 120, "mm_per_px": 0.125}
    soft = {"lights": {"distance_mm": 40, "scatter": 1.0}}
    return load_profile(parent, overrides={"image": image, "optics": soft, **overrides})


def photograph(profile: Profile, path: Path, press: BallPress | None = None, seed: int = 0) -> Path:
    """Render an image and write it."""
    image = profile.image
    shape = image.height_px, image.width_px
    height_mm = np.zeros(shape) if press is None else press.height_mm(shape, image.mm_per_px)
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), render(profile, height_mm, seed=seed)[..., ::-1])
    return path
