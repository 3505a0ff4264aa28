"""An analytic ball pressed into a lit gel: frames with the truth attached, by formula alone.

The skin follows the ball inside the contact and decays exponentially outside it; each lamp lights
a Lambertian coating and fades across the gel. Everything comes from the profile: size, scale,
lights, markers. Good for a first look and for tests; it knows no mechanics.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.profiles.model import Markers, Profile

SKIRT_BALL_FRACTION = 0.3
"""Decay length of the skin around the contact, in ball radii."""

_AMBIENT, _DIRECT, _FADE, _GAMMA, _NOISE, _INK = 0.12, 1.0, 0.35, 2.2, 0.004, 0.25
_DEFAULT_LIGHTS: tuple[Mapping[str, Any], ...] = (
    {"name": "red", "azimuth_deg": 90.0, "elevation_deg": 30.0},
    {"name": "green", "azimuth_deg": 210.0, "elevation_deg": 30.0},
    {"name": "blue", "azimuth_deg": 330.0, "elevation_deg": 30.0},
)


@dataclass(frozen=True)
class BallPress:
    """A ball pressed somewhere.

    Attributes
    ----------
    centre_px : (x, y)
    diameter_mm, depth_mm : float
        Of the ball; how far it indents the skin beyond the contact's border.
    """

    centre_px: tuple[float, float]
    diameter_mm: float
    depth_mm: float

    @property
    def contact_radius_mm(self) -> float:
        """Radius of the circle where the skin leaves the ball."""
        return float(np.sqrt(self.depth_mm * (self.diameter_mm - self.depth_mm)))

    def height_mm(self, shape: tuple[int, int], mm_per_px: float) -> NDArray[np.float64]:
        """(H, W) height of the skin, mm; positive where it is pressed."""
        x = (np.arange(shape[1]) - self.centre_px[0]) * mm_per_px
        y = (np.arange(shape[0])[:, None] - self.centre_px[1]) * mm_per_px
        r, radius, a = np.hypot(x, y), self.diameter_mm / 2, self.contact_radius_mm
        rim = np.sqrt(radius**2 - a**2)
        skirt_mm = SKIRT_BALL_FRACTION * radius
        edge_mm = skirt_mm * a / rim  # so that the slope has no step at the border
        inside = np.sqrt(np.maximum(radius**2 - r**2, 0)) - rim + edge_mm
        return np.asarray(
            np.where(r < a, inside, edge_mm * np.exp(-np.maximum(r - a, 0) / skirt_mm))
        )


def render(profile: Profile, height_mm: NDArray[np.float64], *, seed: int = 0) -> NDArray[np.uint8]:
    """Render the (H, W, K) image of a skin of this height as the profile's camera sees it.

    Deterministic by seed. A light is seen by the channels that it ``feeds``, or else by the one of
    its own name. Azimuths are measured from x towards y, as everywhere.
    """
    image = profile.image
    gy, gx = np.gradient(height_mm, image.mm_per_px)
    norm = np.sqrt(1 + gx**2 + gy**2)
    x = np.linspace(-1, 1, image.width_px)
    y = np.linspace(-1, 1, image.height_px)[:, None]
    shades: dict[str, list[NDArray[Any]]] = {}
    for light in profile.illumination.options.get("lights", _DEFAULT_LIGHTS):
        azimuth, elevation = np.radians([light["azimuth_deg"], light["elevation_deg"]])
        lx, ly = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth)
        shading = (-gx * lx - gy * ly + np.sin(elevation)) / norm
        fade = 1 + _FADE * (x * np.cos(azimuth) + y * np.sin(azimuth))
        for channel in light.get("feeds", (light["name"],)):
            shades.setdefault(channel, []).append(fade * np.maximum(shading, 0))
    planes = [_AMBIENT + _DIRECT * np.mean(lights, axis=0) for lights in shades.values()]
    light_level = np.stack(planes, axis=2) / 1.6
    if isinstance(profile.gel.markers, Markers):
        light_level *= np.where(dots(profile), _INK, 1.0)[..., None]
    noise = np.random.default_rng(seed).normal(0, _NOISE, light_level.shape)
    coded = np.clip(light_level, 0, 1) ** (1 / _GAMMA) + noise
    return np.asarray(np.clip(np.rint(255 * coded), 0, 255), np.uint8)


def dots(profile: Profile) -> NDArray[np.bool_]:
    """(H, W) bool: where the profile's square grid of round marks is printed."""
    image, markers = profile.image, profile.gel.markers
    assert isinstance(markers, Markers)
    x = np.arange(image.width_px) * image.mm_per_px
    y = np.arange(image.height_px)[:, None] * image.mm_per_px

    def offset(position: NDArray[Any]) -> NDArray[Any]:
        return (position + markers.pitch_mm / 2) % markers.pitch_mm - markers.pitch_mm / 2

    return np.asarray(np.hypot(offset(x), offset(y)) < markers.diameter_mm / 2)
