"""Light sources, and the coating that reflects them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32, from_middle
from tactile_core.interfaces.component import SensorBuild
from tactile_sim.optics.lights import LedArray, light_field
from tactile_sim.optics.shadows import Shadows, cast
from tactile_sim.optics.surface import OpticalSurface


@dataclass(frozen=True)
class Coating:
    """A diffuse part, and a specular part of microscopic facets.

    Attributes
    ----------
    specular : float
        Share of the specular part.
    roughness : float
        Roughness of Beckmann's facet distribution.
    """

    specular: float
    roughness: float

    @classmethod
    def from_profile(cls, profile: SensorBuild) -> Coating:
        """Return the coating of the profile's gel and optics."""
        # [share] to look like the coated gels in [1]_, figure 4
        share = 0.2 if profile.gel.coating == "semi_specular" else 0.0
        coat = profile.optics.coat
        return cls(
            share if coat.specular is None else coat.specular,
            # [slope over √2] highlights 20° wide, as in [1]_
            0.35 if coat.roughness is None else coat.roughness,
        )


@dataclass(frozen=True, eq=False)
class Shading:
    """Reflection of one light by one coating, precomputed per pixel.

    Attributes
    ----------
    toward : (3, H, W) float32
        Half the light vectors of the diffuse part, see
        :func:`~tactile_sim.optics.lights.light_field`.
    blur : float
        Softness of the horizon of an extended light, in the units of ``toward``.
    lobe : (3, H, W) float32 or None
        Half vectors between light and camera, times the sharpness of the specular lobe; None
        without a specular part.
    peak : (H, W) float32 or None
        Logarithm of the specular peak, minus the sharpness.

    References
    ----------
    .. [1] Torrance, Sparrow, "Theory for Off-Specular Reflection From Roughened Surfaces", Journal
       of the Optical Society of America 57, 1967.
    .. [2] Wang, Ren, Gong, Snyder, Guo, "All-Frequency Rendering of Dynamic, Spatially-Varying
       Reflectance", ACM Transactions on Graphics 28, 2009.
    """

    toward: Float32
    blur: float
    lobe: Float32 | None = None
    peak: Float32 | None = None

    @classmethod
    def prepare(cls, toward: Float32, blur: float, coating: Coating, view: Float32) -> Shading:
        """Precompute the shading of one light.

        Parameters
        ----------
        toward : (3, H, W) float32
            Light vectors.
        blur : float
            Half the angle that the light subtends, rad, times the length of ``toward``.
        coating : Coating
        view : (3, H, W) float32
            Unit vectors towards the camera.
        """
        diffuse = 0.5 * (1 - coating.specular)
        if coating.specular == 0:
            return cls(toward * np.float32(diffuse), blur * diffuse)
        strength = np.maximum(np.sqrt((toward**2).sum(0)), 1e-9)
        half = toward / strength + view
        half /= np.sqrt((half**2).sum(0))
        # Torrance and Sparrow 1967: D / (4 n·v) of the light, with n·v nearly 1. Beckmann's D is
        # close to exp(2 (n·h − 1) / m²) / m² for n·h near 1 (Wang et al. 2009); its exponent is
        # linear in the normal.
        sharpness = 2 / coating.roughness**2
        gloss = coating.specular * strength * sharpness / 8
        return cls(
            toward * np.float32(diffuse),
            blur * diffuse,
            (half * sharpness).astype(np.float32),
            (np.log(gloss) - sharpness).astype(np.float32),
        )

    def reflect(self, normals: Float32, rows: slice = slice(None)) -> Float32:
        """Return the light reflected towards the camera, without cast shadows.

        Parameters
        ----------
        normals : (3, h, W) float32
            Unit normals; the third component points to the camera.
        rows : slice
            The h rows of the image that they cover.

        Returns
        -------
        (h, W) float32
        """
        light = _softly_positive(_dot(normals, self.toward[:, rows]), self.blur)
        if self.lobe is not None and self.peak is not None:
            specular = _dot(normals, self.lobe[:, rows])
            specular += self.peak[rows]
            light += np.asarray(cv2.exp(specular), np.float32)
        return light


def _dot(a: Float32, b: Float32) -> Float32:
    total = a[0] * b[0]
    # OpenCV multiplies and adds in one pass
    cv2.accumulateProduct(a[1], b[1], total)
    cv2.accumulateProduct(a[2], b[2], total)
    return np.asarray(total)


def _softly_positive(half_cosine: Float32, half_blur: float) -> Float32:
    """Soft clamp of a cosine at 0: an extended light sets gradually below the horizon."""
    constant = _constant(half_cosine.shape, half_blur)
    root = np.asarray(cv2.magnitude(half_cosine, constant), np.float32)
    root += half_cosine
    return root


@lru_cache(maxsize=32)
def _constant(shape: tuple[int, ...], value: float) -> Float32:
    return np.full(shape, value, np.float32)


_BAND_PX = 96  # [px] Rows rendered at once; their buffers fit into the processor's cache


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
        toward = light_field(led_array, shape, mm_per_px=image.mm_per_px, rest_mm=rest_mm)
        # [ratio] every light gives some light
        bright = max(0.1, 1 + led_array.build.spread * float(deviation))
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
        everywhere = ambient * bright * float(np.median(toward[2]))
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
    surface : OpticalSurface
    colours : tuple of str
        Names of the K colours of the camera. A light that feeds none of them feeds all.
    exposures : int
        Number E of exposures of this state; their light is computed together.
    """

    sources: tuple[tuple[int, LightSource, float, int], ...]
    surface: OpticalSurface
    colours: tuple[str, ...]
    exposures: int = 1

    @cached_property
    def shade(self) -> list[Float32] | None:
        """(H, W) share of each light that no relief hides; None without any shadow."""
        relief = self.surface.relief_mm
        if not self.sources or np.ptp(relief) < 0.01:  # mm: too flat to cast shadows
            return None
        shadows = [source.shadows for _, source, _, _ in self.sources]
        low = cv2.resize(relief, shadows[0].size, interpolation=cv2.INTER_AREA)
        return cast(shadows, np.asarray(low, np.float32), relief.shape)

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
        for top in range(0, height, _BAND_PX):
            rows = slice(top, min(top + _BAND_PX, height))
            normals = surface.normals(rows)
            # ambient light is that of half the sky, and of all of it where the surface is level
            sky = normals[2] + 1
            light = np.empty((len(half), *sky.shape), np.float32)
            for channel in unlit:
                np.multiply(sky, half[channel], out=light[channel])
            begun = set(unlit)
            for index, ((number, source, level, _), into) in enumerate(
                zip(self.sources, channels, strict=True)
            ):
                plane = source.shading.reflect(normals, rows)
                if self.shade is not None:
                    plane *= self.shade[index][rows]
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
    # [diagonals] a usual lens
    pupil_mm = profile.optics.sensor.view_distance_mm or 1.5 * diagonal_mm
    view = np.stack(np.broadcast_arrays(-x, -y[:, None], pupil_mm)).astype(np.float32)
    return np.asarray(view / np.sqrt((view**2).sum(0)), np.float32)
