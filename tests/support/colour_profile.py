"""A profile of a sensor with a colour image, at any size and scale."""

from __future__ import annotations

from pathlib import Path

from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile


def colour_profile(folder: Path, width: int, height: int, mm_per_px: float = 0.0634) -> Profile:
    """Write the profile into a folder and load it."""
    path = folder / "mini.yaml"
    path.write_text(
        f"schema: 1\nname: mini\nimage: {{width_px: {width}, height_px: {height}, "
        f"mm_per_px: {mm_per_px}}}\nillumination: {{use: core.constant}}\n"
        "calibration: {use: core.automatic}\nestimators: {height: {use: core.poisson}}\n"
    )
    return load_profile(path)
