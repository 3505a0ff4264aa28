"""Appearance of the gel surface: relief, markers and grain, moved by the displacement."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.heights.sphere import rest_height
from tactile_core.interfaces.component import SensorBuild
from tactile_sim.optics.faults import Faults
from tactile_sim.optics.markers import MarkerPrint

_MARGIN = 0.1  # [image widths] Border around the image that shear may move into it
_SIGMAS_PER_GRAIN: float = 2  # [ratio] Size of the grain over the Gaussian sigma that correlates it


@dataclass(frozen=True, eq=False)
class OpticalSurface:
    """One state of the gel surface, ready to be illuminated.

    Attributes
    ----------
    relief_mm : (H, W) float32
        Height above the undeformed surface, as far as it shades.
    rest_slopes : (2, H, W) float32 or None
        Slopes of the undeformed surface; None if flat.
    mm_per_px : float
    reflectance : (H, W) float32 or None
        1 on the bare surface, less on markers; None without markers.
    textures : (T, H, W, 4) float32
        Grain as a factor on each light, four lights to an image. Grain differs between lights,
        because facets reflect only some of them.
    """

    relief_mm: Float32
    rest_slopes: Float32 | None
    mm_per_px: float
    reflectance: Float32 | None
    textures: Float32

    def grain(self, led_array: int) -> Float32:
        """(H, W) grain: factor on the light of this index."""
        return _plane(self.textures, led_array)

    def normals(self, rows: slice) -> Float32:
        """(3, h, W) unit normals of a band of rows, the third component towards the camera."""
        band = self.relief_mm[rows]
        normals = np.empty((3, *band.shape), np.float32)
        x, y, up = normals
        _write_differences(self.relief_mm, rows.start, x, y)
        run_mm = np.float32(2 * self.mm_per_px)
        if self.rest_slopes is not None:
            x += self.rest_slopes[0, rows] * run_mm
            y += self.rest_slopes[1, rows] * run_mm
        np.multiply(x, x, out=up)
        cv2.accumulateSquare(y, up)
        up += run_mm * run_mm
        cv2.sqrt(up, dst=up)
        np.divide(np.float32(-1), up, out=up)
        x *= up
        y *= up
        up *= -run_mm
        return normals


class Membrane:
    """Appearance of one gel, in all its states.

    Parameters
    ----------
    profile : SensorBuild
    led_arrays : int
        Number of lights; each has its own grain.
    faults : Faults
    seed : int
    """

    def __init__(self, profile: SensorBuild, led_arrays: int, faults: Faults, seed: int) -> None:
        image, coat = profile.image, profile.optics.coat
        self._shape = (image.height_px, image.width_px)
        self._mm_per_px = image.mm_per_px
        self._absorption = np.float32(coat.absorption_per_mm)
        self._volumetric = coat.scatters == "volume"
        self.markers = MarkerPrint.from_profile(profile, faults, seed)
        self.rest_mm: Float32 | None = None
        self._rest_slopes: Float32 | None = None
        if profile.gel.radius_mm is not None:
            # A dome's border is closer to the camera: negative z in the sensor frame.
            self.rest_mm = -rest_height(
                self._shape, mm_per_px=image.mm_per_px, radius_mm=profile.gel.radius_mm
            )
            self._rest_slopes = _slopes(self.rest_mm, image.mm_per_px)
        self._margin = round(_MARGIN * image.width_px)
        wide = (self._shape[0] + 2 * self._margin, self._shape[1] + 2 * self._margin)
        rng = np.random.default_rng([seed, 31])
        size_px = (coat.grain_mm or image.mm_per_px) / image.mm_per_px
        textures = [_grain(wide, coat.grain, size_px, rng) for _ in range(led_arrays)]
        # Remapping an image of four channels takes as long as one of a single channel.
        self._textures = np.zeros((-(-len(textures) // 4), *wide, 4), np.float32)
        for number, texture in enumerate(textures):
            _plane(self._textures, number)[...] = texture
        (rows, columns), m = self._shape, self._margin
        self._at_rest = self._textures[:, m : m + rows, m : m + columns].copy()
        # columns and rows of the textures at the pixels
        self._places = np.indices(self._shape, np.float32)[::-1] + np.float32(m)

    def state(
        self,
        height_mm: Float32,
        displacement_mm: Float32 | None = None,
        markers_px: NDArray[np.float64] | None = None,
    ) -> OpticalSurface:
        """Return one state of the surface; parameters as for ``RigOptics.expose``."""
        textures = self._move_textures(displacement_mm)
        reflectance = None
        if self.markers is not None:
            if markers_px is None:
                markers_px = self._carry_markers(self.markers.rest_px, displacement_mm)
            reflectance = self.markers.reflectance(self._shape, markers_px)
        if self._absorption:
            # where it bulges, a gel that scatters within is thicker and brighter
            lowest_mm = -np.inf if self._volumetric else 0
            darker = np.exp(-self._absorption * np.maximum(height_mm, lowest_mm))
            reflectance = darker if reflectance is None else reflectance * darker
        relief_mm = np.zeros_like(height_mm) if self._volumetric else height_mm
        return OpticalSurface(relief_mm, self._rest_slopes, self._mm_per_px, reflectance, textures)

    def _carry_markers(
        self, rest_px: NDArray[np.float64], displacement_mm: Float32 | None
    ) -> NDArray[np.float64]:
        """Marker centres after the displacement of the pixels on which they were printed."""
        if displacement_mm is None:
            return rest_px
        rows, columns = (
            np.clip(np.rint(rest_px[:, axis]).astype(int), 0, self._shape[1 - axis] - 1)
            for axis in (1, 0)
        )
        moved_px = displacement_mm[rows, columns] / self._mm_per_px
        return np.asarray(rest_px + moved_px, np.float64)

    def _move_textures(self, displacement_mm: Float32 | None) -> Float32:
        """Every texture, moved by the displacement."""
        if displacement_mm is None:
            return self._at_rest
        px = -1 / self._mm_per_px
        # one pass each, whatever the layout of the displacement
        x, y = (
            cv2.scaleAdd(np.ascontiguousarray(displacement_mm[..., axis]), px, self._places[axis])
            for axis in range(2)
        )
        moved = np.empty_like(self._at_rest)
        for texture, out in zip(self._textures, moved, strict=True):
            cv2.remap(texture, x, y, cv2.INTER_LINEAR, dst=out, borderMode=cv2.BORDER_REFLECT_101)
        return moved


def _plane(textures: Float32, number: int) -> Float32:
    """View of one texture: a copy would cost more than strided reads."""
    return textures[number // 4, ..., number % 4]


def _slopes(height_mm: Float32, mm_per_px: float) -> Float32:
    """(2, H, W) central differences along x and y; one-sided at the border."""
    slopes = np.empty((2, *height_mm.shape), np.float32)
    _write_differences(height_mm, 0, *slopes)
    slopes *= np.float32(0.5 / mm_per_px)
    return slopes


def _write_differences(height_mm: Float32, top: int, x: Float32, y: Float32) -> None:
    """Write how much a band of rows rises over two pixels; its first row is ``top``."""
    band = height_mm[top : top + len(x)]
    np.subtract(band[:, 2:], band[:, :-2], out=x[:, 1:-1])
    # twice as much, because their distance is half as long
    x[:, 0], x[:, -1] = 2 * (band[:, 1] - band[:, 0]), 2 * (band[:, -1] - band[:, -2])
    last = len(height_mm) - 1
    first, stop = max(top, 1), min(top + len(x), last)
    below, above = height_mm[first + 1 : stop + 1], height_mm[first - 1 : stop - 1]
    np.subtract(below, above, out=y[first - top : stop - top])
    if top == 0:
        y[0] = 2 * (height_mm[1] - height_mm[0])
    if top + len(x) > last:
        y[-1] = 2 * (height_mm[last] - height_mm[last - 1])


def _grain(
    shape: tuple[int, int], deviation: float, size_px: float, rng: np.random.Generator
) -> Float32:
    """Factor about 1 of the given standard deviation and correlation length."""
    noise = rng.standard_normal(shape, np.float32)
    if size_px > 1:
        sigma_px = size_px / _SIGMAS_PER_GRAIN
        noise = np.asarray(cv2.GaussianBlur(noise, (0, 0), sigma_px), np.float32)
        noise /= noise.std()
    return np.asarray(np.maximum(1 + np.float32(deviation) * noise, 0), np.float32)
