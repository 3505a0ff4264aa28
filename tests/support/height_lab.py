"""Recordings of a surface with a height map under six sequential lights, on disk."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.formats.tmd import write_tmd

HEIGHT, WIDTH, MM_PER_PX = 120, 160, 0.05
AZIMUTHS_DEG = (-90, -30, 30, 90, 150, -150)

PROFILE = f"""\
schema: 1
name: height_lab
description: Six sequential lights
image: {{width_px: {WIDTH}, height_px: {HEIGHT}, mm_per_px: {MM_PER_PX}, color: grey}}
camera: {{use: core.replay}}
illumination:
  use: core.sequential
  lights:
""" + "".join(
    f"    - {{name: led{k}, azimuth_deg: {azimuth}, elevation_deg: 35}}\n"
    for k, azimuth in enumerate(AZIMUTHS_DEG)
)
PROFILE += """\
calibration: {use: core.polynomial, blur_px: 1}
estimators: {height: {use: core.poisson}}
"""


@dataclass(frozen=True)
class HeightLab:
    """Recordings of a relief with ground truth, and of the undeformed sensor."""

    folder: Path
    height_mm: NDArray[np.float64]

    @property
    def profile(self) -> Path:
        return self.folder / "height_lab.yaml"

    @property
    def press(self) -> Path:
        return self.folder / "press"

    @property
    def undeformed(self) -> Path:
        return self.folder / "undeformed"

    @property
    def tmd(self) -> Path:
        return self.folder / "map.tmd"


def relief() -> NDArray[np.float64]:
    """Wavy grooves, less deep than wide, in a level surface."""
    x = np.arange(WIDTH) * MM_PER_PX
    y = np.arange(HEIGHT)[:, None] * MM_PER_PX
    height = np.zeros((HEIGHT, WIDTH))
    for middle, width, depth in ((1.5, 0.4, 0.2), (4.0, 0.3, 0.1), (6.5, 0.4, 0.25)):
        at = middle + 0.3 * np.sin(1.5 * y + middle)
        height -= depth * np.exp(-(((x - at) / width) ** 2))
    return height


def lit(height_mm: NDArray[np.float64], seed: int) -> list[NDArray[np.uint8]]:
    """One exposure per light: Lambertian, with a light that fades across the gel."""
    gy, gx = np.gradient(height_mm, MM_PER_PX)
    x = np.linspace(-1, 1, WIDTH)
    y = np.linspace(-1, 1, HEIGHT)[:, None]
    rng = np.random.default_rng(seed)
    exposures = []
    for azimuth in np.radians(AZIMUTHS_DEG):
        lx, ly, lz = 0.8 * np.cos(azimuth), 0.8 * np.sin(azimuth), 0.6
        shading = np.maximum((-gx * lx - gy * ly + lz) / np.sqrt(1 + gx**2 + gy**2), 0)
        fade = np.exp(0.2 * (x * np.cos(azimuth) + y * np.sin(azimuth)))
        level = 20 + 170 * fade * shading + rng.normal(0, 0.5, height_mm.shape)
        exposures.append(np.clip(np.rint(level), 0, 255).astype(np.uint8))
    return exposures


def make_height_lab(folder: Path) -> HeightLab:
    """Write the recordings, the map (tilted: its plane is arbitrary) and the profile."""
    lab = HeightLab(folder, relief())
    lab.profile.write_text(PROFILE)
    for path, height, seed in ((lab.press, lab.height_mm, 1), (lab.undeformed, 0 * relief(), 2)):
        path.mkdir(parents=True)
        for k, exposure in enumerate(lit(height, seed)):
            cv2.imwrite(str(path / f"led{k}.png"), exposure)
    tilt = 0.3 + 0.002 * np.arange(WIDTH) - 0.001 * np.arange(HEIGHT)[:, None]
    write_tmd(lab.tmd, (lab.height_mm + tilt).astype(np.float32), MM_PER_PX)
    return lab
