"""LED arrays of a rig, and the light that each sends to every point of the gel surface."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.acquisition.devices import exposures_of, lights_of
from tactile_core.algorithms.arrays.types import Float32, from_middle
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.gel import LightBuild
from tactile_core.interfaces.illumination import Illumination, Light

_LED_MM = 1.0  # Size of one LED: it blurs shadows and bounds the intensity close to it


@dataclass(frozen=True)
class LedArray:
    """LED array of one light.

    Attributes
    ----------
    name : str
    azimuth_deg, elevation_deg : float
        Direction from the image centre: from x towards y, and above the gel surface.
    distance_mm : float
        Distance from the image centre.
    feeds : tuple of str
        Channels that receive its colour. If an exposure has none of them, all its channels do.
    build : LightBuild
        Layout and emission of the LEDs.
    """

    name: str
    azimuth_deg: float
    elevation_deg: float
    distance_mm: float
    feeds: tuple[str, ...]
    build: LightBuild

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3) unit vectors as rows: along the gel, up the board, and the LEDs' axis."""
        azimuth = np.radians(self.azimuth_deg)
        out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        along = np.array([-out[1], out[0], 0.0])
        forward = -self.build.aim_mm * out - self.centre_mm
        forward /= np.linalg.norm(forward)
        return np.stack([along, np.cross(forward, along), forward])

    @property
    def centre_mm(self) -> NDArray[np.float64]:
        """(3,) centre of the array: x, y, and height above the gel surface."""
        azimuth, elevation = np.radians([self.azimuth_deg, self.elevation_deg])
        level = np.cos(elevation)
        toward = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)]
        return self.distance_mm * np.array(toward)

    @property
    def leds_mm(self) -> NDArray[np.float64]:
        """(N, 3) positions of the LEDs, row by row."""
        rows, columns = self.build.array
        up = from_middle(rows) * self.build.pitch_mm
        aside = from_middle(columns) * self.build.pitch_mm
        along, board, _ = self.axes
        offsets = up[:, None, None] * board + aside[:, None] * along
        return np.asarray(self.centre_mm + offsets.reshape(-1, 3))

    @property
    def blur(self) -> float:
        """Half the vertical angle that the array subtends, rad: the softness of its shadows."""
        size_mm = (self.build.array[0] - 1) * self.build.pitch_mm + _LED_MM
        # rad: a diffuser that scatters fully adds half an angle of 0.2
        return 0.5 * size_mm / self.distance_mm + 0.2 * self.build.scatter


def light_field(
    led_array: LedArray,
    shape: tuple[int, int],
    *,
    mm_per_px: float,
    rest_mm: Float32 | None = None,
) -> Float32:
    """Light vectors of one LED array over the undeformed gel surface.

    Each LED emits with cosᵐ of the angle from its axis, and its light decreases with the square of
    the distance.

    Parameters
    ----------
    led_array : LedArray
    shape : (height, width) in px
    mm_per_px : float
    rest_mm : (H, W) float32, optional
        Height of the undeformed surface towards the camera; flat by default.

    Returns
    -------
    (3, H, W) float32
        x, y and height of the vector towards the light. Its length is the irradiance at normal
        incidence, with a median of 1.
    """
    height, width = shape
    # near light varies over millimetres, so a point every 8 px is enough
    size = (max(2, round(width / 8)), max(2, round(height / 8)))
    # Centres of coarse pixels, as cv2.resize defines them.
    x = ((np.arange(size[0]) + 0.5) * width / size[0] - width / 2) * mm_per_px
    y = ((np.arange(size[1]) + 0.5) * height / size[1] - height / 2)[:, None] * mm_per_px
    z = np.zeros((1, 1)) if rest_mm is None else cv2.resize(rest_mm, size)
    lobe_power = np.log(0.5) / np.log(np.cos(np.radians(led_array.build.lobe_deg) / 2))
    whole = np.zeros((3, size[1], size[0]))
    for px, py, pz in led_array.leds_mm:
        ray = np.stack(np.broadcast_arrays(px - x, py - y, pz - z))
        far = np.maximum(np.sqrt((ray**2).sum(0)), _LED_MM)
        along = np.maximum(-np.tensordot(led_array.axes[2], ray, 1) / far, 0)
        whole += ray * (along**lobe_power / far**3)
    strength = np.median(np.linalg.norm(whole, axis=0))
    middle = led_array.centre_mm / led_array.distance_mm
    share = led_array.build.scatter
    field = (1 - share) * whole / strength + share * middle[:, None, None]
    coarse = field.transpose(1, 2, 0).astype(np.float32)
    fine = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.ascontiguousarray(fine.transpose(2, 0, 1))


def led_arrays_of(profile: SensorBuild, illumination: Illumination) -> tuple[LedArray, ...]:
    """Return the LED arrays of an illumination's lights.

    Keys of a light override those of ``optics.lights``. If the illumination does not describe
    every light that its exposures name, all lights are spaced evenly around the image.
    """
    image = profile.image
    diagonal_mm = float(np.hypot(image.width_px, image.height_px)) * image.mm_per_px
    general = profile.optics.lights.model_dump()
    default_mm = 0.8 * diagonal_mm
    exposures = exposures_of(illumination)
    colors = {name: shot.color for shot in exposures for name in shot.levels if shot.color}
    led_arrays = []
    for light in _place_lights(illumination):
        build = LightBuild.model_validate(general | light.build.model_dump(exclude_unset=True))
        led_arrays.append(
            LedArray(
                name=light.name,
                azimuth_deg=light.azimuth_deg,
                elevation_deg=light.elevation_deg,
                distance_mm=build.distance_mm or default_mm,
                feeds=light.feeds or (colors.get(light.name, light.name),),
                build=build,
            )
        )
    return tuple(led_arrays)


def _place_lights(illumination: Illumination) -> tuple[Light, ...]:
    exposures, lights = exposures_of(illumination), lights_of(illumination)
    names = list(dict.fromkeys(name for exposure in exposures for name in exposure.levels))
    if lights and {light.name for light in lights} >= set(names):
        return lights
    return tuple(
        Light(name, 90 + 360 * number / len(names), 30.0) for number, name in enumerate(names)
    )
