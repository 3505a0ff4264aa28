"""Small virtual rigs and synthetic gel surfaces with ground truth."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.profiles.model import Profile

WIDTH, HEIGHT, SCALE_MM = 160, 120, 0.1
SHAPE = (HEIGHT, WIDTH)


def rig(
    azimuths_deg: tuple[float, ...] = (0.0,),
    *,
    elevation_deg: float = 30.0,
    in_turn: bool = False,
    image: dict[str, Any] | None = None,
    gel: dict[str, Any] | None = None,
    optics: dict[str, Any] | None = None,
) -> Profile:
    """Return a rig with a linear grey camera and lights at these azimuths."""
    lights = [
        {"name": f"led{k}", "azimuth_deg": azimuth, "elevation_deg": elevation_deg}
        for k, azimuth in enumerate(azimuths_deg)
    ]
    together = {"use": "core.constant", "channels": ["grey"], "lights": lights}
    return Profile.model_validate(
        {
            "schema": 1,
            "name": "looked_at",
            "image": {
                "width_px": WIDTH,
                "height_px": HEIGHT,
                "mm_per_px": SCALE_MM,
                "color": "grey",
                "transfer": "linear",
                "bit_depth": 16,
            }
            | (image or {}),
            "gel": gel or {},
            "illumination": {"use": "core.sequential", "lights": lights} if in_turn else together,
            "optics": {"ambient": 0.0, "coat": {"grain": 0.0}} | (optics or {}),
        }
    )


QUIET = {"full_well_e": 1e9, "read_noise_e": 0.0, "vignetting": 0.0, "exposure": 0.2}
"""A camera without noise, exposed for headroom above the undeformed gel."""


def level() -> NDArray[np.float32]:
    """An undeformed gel surface."""
    return np.zeros(SHAPE, np.float32)


def slope(x: float = 0.0, y: float = 0.0) -> NDArray[np.float32]:
    """A plane that rises with x and y."""
    place_y, place_x = np.mgrid[:HEIGHT, :WIDTH] * SCALE_MM
    return np.asarray(x * place_x + y * place_y, np.float32)


def bump(height_mm: float = 0.5, radius_mm: float = 1.5) -> NDArray[np.float32]:
    """A round bump at the centre."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    r = np.hypot(x - (WIDTH - 1) / 2, y - (HEIGHT - 1) / 2) * SCALE_MM
    return np.asarray(height_mm * np.exp(-((r / radius_mm) ** 2)), np.float32)


def shift(x_mm: float, y_mm: float = 0.0) -> NDArray[np.float32]:
    """A uniform displacement of the gel surface."""
    return np.asarray(np.broadcast_to([x_mm, y_mm], (*SHAPE, 2)), np.float32)
