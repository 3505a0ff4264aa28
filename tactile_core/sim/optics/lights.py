"""The lamps of a rig and the light that each of them sends to every place of the skin."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.acquisition.assembly import exposures_of, lights_of
from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Float32
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.illumination import Illumination, Light
from tactile_core.interfaces.optics import LightBuild

_DEFAULT_ELEVATION_DEG = 30.0
_DEFAULT_DISTANCE_DIAGONALS = 0.8
_LED_MM = 1.0
_COARSE_PX = 8
"""Near light changes over millimetres: it is computed on every eighth pixel and interpolated."""


@dataclass(frozen=True)
class LedArray:
    """One lamp: an array of LEDs that shine towards the skin.

    Attributes
    ----------
    name : str
    azimuth_deg, elevation_deg : float
        Where it stands, as seen from the image centre: from x towards y, and above the skin.
    distance_mm : float
        From the image centre.
    feeds : tuple of str
        Channels that see its colour; none of an exposure's means all of them.
    build : Lamps
        Its LEDs.
    """

    name: str
    azimuth_deg: float
    elevation_deg: float
    distance_mm: float
    feeds: tuple[str, ...]
    build: LightBuild

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3) unit vectors as rows: along the gel, up the board, and where the LEDs shine."""
        azimuth = np.radians(self.azimuth_deg)
        out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        along = np.array([-out[1], out[0], 0.0])
        forth = -self.build.aim_mm * out - self.place_mm
        forth /= np.linalg.norm(forth)
        return np.stack([along, np.cross(forth, along), forth])

    @property
    def place_mm(self) -> NDArray[np.float64]:
        """(3,) middle of the lamp: x, y, and height above the skin towards the camera."""
        azimuth, elevation = np.radians([self.azimuth_deg, self.elevation_deg])
        level = np.cos(elevation)
        toward = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)]
        return self.distance_mm * np.array(toward)

    @property
    def leds_mm(self) -> NDArray[np.float64]:
        """(N, 3) places of its LEDs, row by row."""
        rows, columns = self.build.array
        up = from_middle(rows) * self.build.pitch_mm
        aside = from_middle(columns) * self.build.pitch_mm
        along, board, _ = self.axes
        offsets = up[:, None, None] * board + aside[:, None] * along
        return np.asarray(self.place_mm + offsets.reshape(-1, 3))

    @property
    def blur(self) -> float:
        """Half the angle, in rad, that it fills up and down: how gradually its shadows begin."""
        size_mm = (self.build.array[0] - 1) * self.build.pitch_mm + _LED_MM
        return 0.5 * size_mm / self.distance_mm + 0.2 * self.build.scatter


def light_field(
    led_array: LedArray,
    shape: tuple[int, int],
    *,
    mm_per_px: float,
    rest_mm: Float32 | None = None,
    dead_leds: tuple[int, ...] = (),
) -> Float32:
    """Light vectors of one lamp over the skin at rest.

    Each LED sends cosᵐ of the angle from its axis, which fades with the square of the distance.

    Parameters
    ----------
    led_array : Lamp
    shape : (height, width) in px
    mm_per_px : float
    rest_mm : (H, W) float32, optional
        Height of the skin at rest, towards the camera; flat if left out.
    dead_leds : tuple of int
        Indices of LEDs that do not shine.

    Returns
    -------
    (3, H, W) float32
        x, y and height of the vector towards the lamp, as long as the irradiance that a skin
        facing it receives; 1 in the median of a lamp whose LEDs are whole.
    """
    height, width = shape
    size = (max(2, round(width / _COARSE_PX)), max(2, round(height / _COARSE_PX)))
    # Centres of coarse pixels, as cv2.resize understands them.
    x = ((np.arange(size[0]) + 0.5) * width / size[0] - width / 2) * mm_per_px
    y = ((np.arange(size[1]) + 0.5) * height / size[1] - height / 2)[:, None] * mm_per_px
    z = np.zeros((1, 1)) if rest_mm is None else cv2.resize(rest_mm, size)
    lobe_power = np.log(0.5) / np.log(np.cos(np.radians(led_array.build.lobe_deg) / 2))
    whole = np.zeros((3, size[1], size[0]))
    shining = np.zeros_like(whole)
    for number, (px, py, pz) in enumerate(led_array.leds_mm):
        ray = np.stack(np.broadcast_arrays(px - x, py - y, pz - z))
        far = np.maximum(np.sqrt((ray**2).sum(0)), _LED_MM)
        along = np.maximum(-np.tensordot(led_array.axes[2], ray, 1) / far, 0)
        vector = ray * (along**lobe_power / far**3)
        whole += vector
        if number not in dead_leds:
            shining += vector
    strength = np.median(np.linalg.norm(whole, axis=0))
    middle = led_array.place_mm / led_array.distance_mm
    share = led_array.build.scatter
    alight = 1 - len(set(dead_leds)) / len(led_array.leds_mm)
    field = (1 - share) * shining / strength + share * alight * middle[:, None, None]
    coarse = field.transpose(1, 2, 0).astype(np.float32)
    fine = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.ascontiguousarray(fine.transpose(2, 0, 1))


def led_arrays_of(profile: SensorBuild, illumination: Illumination) -> tuple[LedArray, ...]:
    """Return the lamps of an illumination, each built as it says itself or else as the profile.

    Where its lights are not all that its exposures name, lights stand evenly around.
    """
    image = profile.image
    diagonal_mm = float(np.hypot(image.width_px, image.height_px)) * image.mm_per_px
    general = profile.optics.lights.model_dump()
    default_mm = _DEFAULT_DISTANCE_DIAGONALS * diagonal_mm
    led_arrays = []
    for light in _placed(illumination):
        build = LightBuild.model_validate(general | light.build.model_dump(exclude_unset=True))
        led_arrays.append(
            LedArray(
                name=light.name,
                azimuth_deg=light.azimuth_deg,
                elevation_deg=light.elevation_deg,
                distance_mm=build.distance_mm or default_mm,
                feeds=light.feeds or (light.name,),
                build=build,
            )
        )
    return tuple(led_arrays)


def _placed(illumination: Illumination) -> tuple[Light, ...]:
    exposures, lights = exposures_of(illumination), lights_of(illumination)
    names = list(dict.fromkeys(name for exposure in exposures for name in exposure.levels))
    if lights and {light.name for light in lights} >= set(names):
        return lights
    return tuple(
        Light(name, 90 + 360 * number / len(names), _DEFAULT_ELEVATION_DEG)
        for number, name in enumerate(names)
    )
