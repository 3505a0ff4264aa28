"""Light sources over a coating: the light that each sends to the camera via the gel surface."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32, from_middle
from tactile_core.interfaces.component import SensorBuild
from tactile_core.sim.optics.coating import Coating, Shading
from tactile_core.sim.optics.faults import Faults
from tactile_core.sim.optics.lights import LedArray, light_field
from tactile_core.sim.optics.shadows import Shade, Shadows, cast
from tactile_core.sim.optics.surface import Surface


class SOURCES:
    """Parameters of light sources and camera position."""

    # [diagonals of the view] Distance from the gel surface to the pupil if the profile does not
    # set it.
    view_diagonals = 1.5
    min_brightness = 0.1  # [ratio] Lower bound of a light's random brightness
    band_px = 96  # [px] Rows rendered at once; their buffers fit into the processor's cache


@dataclass(frozen=True, eq=False)
class LightSource:
    """One light, prepared to illuminate any state of the gel surface.

    Attributes
    ----------
    led_array : LedArray
    shading : Shading
    shadows : Shadows
    ambient : float
        This light's contribution to the ambient light.
    """

    led_array: LedArray
    shading: Shading
    shadows: Shadows
    ambient: float


def sources_of(
    profile: SensorBuild,
    led_arrays: Sequence[LedArray],
    *,
    rest_mm: Float32 | None,
    faults: Faults,
    seed: int,
    shadow_columns: int,
) -> tuple[LightSource, ...]:
    """Prepare the lights of a rig for a profile's coating.

    Parameters
    ----------
    profile : SensorBuild
    led_arrays : sequence of LedArray
    rest_mm : (H, W) float32 or None
        Height of the undeformed surface towards the camera; None for a flat gel.
    faults : Faults
        Its dead LEDs are off.
    seed : int
        Random seed of the lights' relative brightness.
    shadow_columns : int
        Approximate width of the grid on which shadows are computed, px.
    """
    image, ambient = profile.image, profile.optics.ambient
    shape = (image.height_px, image.width_px)
    coating = Coating.from_profile(profile)
    view = _towards_camera(profile, shape)
    deviations = np.random.default_rng([seed, 41]).standard_normal(len(led_arrays))
    made = []
    for led_array, deviation in zip(led_arrays, deviations, strict=True):
        whole, toward = (
            light_field(
                led_array, shape, mm_per_px=image.mm_per_px, rest_mm=rest_mm, dead_leds=dead
            )
            for dead in ((), faults.dead_leds.get(led_array.name, ()))
        )
        bright = max(SOURCES.min_brightness, 1 + led_array.build.spread * float(deviation))
        direct = (1 - ambient) * bright
        shading = Shading.prepare(
            toward * np.float32(direct), led_array.blur * direct, coating, view
        )
        shadows = Shadows.prepare(
            toward,
            led_array.blur,
            mm_per_px=image.mm_per_px,
            reduce=max(1, image.width_px // shadow_columns),
        )
        everywhere = ambient * bright * float(np.median(whole[2]))
        made.append(LightSource(led_array, shading, shadows, everywhere))
    return tuple(made)


@dataclass(frozen=True, eq=False)
class Shining:
    """Lights that illuminate one state of the gel surface.

    Attributes
    ----------
    sources : tuple of (number, LightSource, level, exposure)
        Index of each light in the rig, the light, its brightness, and the exposure in which it is
        on.
    surface : Surface
    colours : tuple of str
        Names of the K colours of the camera. A light that feeds none of them feeds all.
    exposures : int
        Number E of exposures of this state; their light is computed together.
    """

    sources: tuple[tuple[int, LightSource, float, int], ...]
    surface: Surface
    colours: tuple[str, ...]
    exposures: int = 1

    @cached_property
    def shade(self) -> Shade | None:
        """Where the lights are hidden; None without any shadow."""
        if not self.sources:
            return None
        shadows = [source.shadows for _, source, _, _ in self.sources]
        low = self.surface.reduce_relief(shadows[0].size)
        return None if low is None else cast(shadows, low, self.surface.relief_mm.shape)

    @property
    def fed(self) -> NDArray[np.bool_]:
        """(S, E K) bool: channels that receive each light, one exposure after the other."""
        fed = np.zeros((len(self.sources), self.exposures, len(self.colours)), np.bool_)
        for into, (_, source, _, exposure) in zip(fed, self.sources, strict=True):
            named = [name in source.led_array.feeds for name in self.colours]
            into[exposure] = named if any(named) else True
        return fed.reshape(len(self.sources), self.exposures * len(self.colours))

    @property
    def ambient(self) -> Float32:
        """(E K,) ambient light of each channel."""
        each = np.array([level * source.ambient for _, source, level, _ in self.sources])
        return np.asarray(each @ self.fed, np.float32)

    def bands(self, glass: Float32 | None = None) -> Iterator[tuple[slice, Float32]]:
        """Yield bands of rows, and the (E K, h, W) light that they send to the camera.

        Parameters
        ----------
        glass : (H, W) float32, optional
            Transmission of the lens. Default: 1.
        """
        surface, half = self.surface, 0.5 * self.ambient
        channels = [np.flatnonzero(into).tolist() for into in self.fed]
        unlit = set(range(len(half))).difference(*channels)
        height = len(surface.relief_mm)
        for top in range(0, height, SOURCES.band_px):
            rows = slice(top, min(top + SOURCES.band_px, height))
            normals = surface.normals(rows)
            # ambient light is that of half the sky, and of all of it where the surface is level
            sky = normals[2] + 1
            light = np.empty((len(half), *sky.shape), np.float32)
            for channel in unlit:
                np.multiply(sky, half[channel], out=light[channel])
            begun = set(unlit)
            dark = None if self.shade is None else self.shade.shares(rows)
            for index, ((number, source, level, _), into) in enumerate(
                zip(self.sources, channels, strict=True)
            ):
                plane = source.shading.reflect(normals, rows)
                if self.shade is not None and dark is not None:
                    plane[dark[0], self.shade.columns] *= dark[1][index]
                plane *= surface.grain(number)[rows]
                if level != 1:
                    plane *= np.float32(level)
                for channel in into:
                    if channel in begun:
                        light[channel] += plane
                    else:
                        cv2.scaleAdd(sky, float(half[channel]), plane, dst=light[channel])
                        begun.add(channel)
            dimming = [part[rows] for part in (surface.reflectance, glass) if part is not None]
            if dimming:
                light *= dimming[0] if len(dimming) == 1 else dimming[0] * dimming[1]
            yield rows, light


def _towards_camera(profile: SensorBuild, shape: tuple[int, int]) -> Float32:
    """(3, H, W) unit vectors from the gel surface to the pupil, above the image centre."""
    y, x = (from_middle(n) * profile.image.mm_per_px for n in shape)
    diagonal_mm = 2 * float(np.hypot(x[-1], y[-1]))
    pupil_mm = profile.optics.sensor.view_distance_mm or SOURCES.view_diagonals * diagonal_mm
    view = np.stack(np.broadcast_arrays(-x, -y[:, None], pupil_mm)).astype(np.float32)
    return np.asarray(view / np.sqrt((view**2).sum(0)), np.float32)
