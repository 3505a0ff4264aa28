"""A light field prepared for one reference, which measures an image in a few milliseconds."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.algorithms.light.photometric import place
from tactile_core.algorithms.slopes.sampling import Sampling
from tactile_core.algorithms.slopes.slope_grid import PressLight, SlopeCells
from tactile_core.quantities import Reference
from tactile_desktop_six_led.light_field import LEAST_RATIO, LightField
from tactile_desktop_six_led.lit_lights import LitLights
from tactile_desktop_six_led.redundancy import Redundancy

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
UInt8 = NDArray[np.uint8]

# [ratio to the undeformed surface] Lower limit of the unnormalised normal's component towards the
# camera, 1 on undeformed gel. Smaller values would give unbounded slopes.
_LEAST_FACING = np.float32(0.2)

_LEVELS = np.arange(256, dtype=np.float32)


class StereoField:
    """Photometric stereo of one unit relative to one reference. Thread-safe.

    Parameters
    ----------
    field : LightField
    redundancy : Redundancy
    press_light : PressLight
    lit_lights : LitLights
    reference : Reference
        The undeformed sensor.
    blur_px : float
        Standard deviation of the smoothing.
    """

    def __init__(
        self,
        field: LightField,
        redundancy: Redundancy,
        press_light: PressLight,
        lit_lights: LitLights,
        reference: Reference,
        blur_px: float,
    ) -> None:
        self._field, self._redundancy = field, redundancy
        self._press_light, self._lit_lights = press_light, lit_lights
        pixels, markers, full_scale = reference.pixels, reference.marker_mask, reference.full_scale
        self._sampling = Sampling.for_shape((len(pixels), pixels.shape[1]), markers, blur_px)
        base = np.stack(self._sampling.planes(pixels, markers)).astype(np.float32)
        lights, height, width = base.shape
        self._place = place((height, width)).reshape(-1, 2)
        # (I / I⁰) ^ e = I ^ e · (I⁰) ^ −e, where the second factor is the same for all frames.
        floor = np.float32(LEVELS.least_divisor_share * full_scale)
        self._undeformed = np.maximum(base, floor) ** -field.exponents[:, None, None]
        self._rows = field.rows(self._place).reshape(3, lights, height, width)
        self._tilt = press_light.tilt_over((height, width))
        self._least_level = np.float32(LEAST_RATIO * full_scale)

    def measure(
        self, pixels: NDArray[Any], marker_mask: Bool | None = None
    ) -> tuple[SlopeCells, UInt8]:
        """Measure one frame.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marker_mask : (H, W) bool, optional

        Returns
        -------
        slopes : SlopeCells
        inconsistent : (h, w) uint8
            1 for cells where the lights contradict each other, else 0.
        """
        response, b = self._directions(pixels, marker_mask)
        strength = self._press_light.strength(b[:2])
        b[:2] += strength * self._tilt
        bright, inconsistent = self._replace_outliers(response, b, strength)
        self._replace_shaded(response, b, bright)
        np.maximum(b[2], _LEAST_FACING, out=b[2])
        gx, gy = (np.asarray(cv2.divide(component, b[2]), np.float32) for component in b[:2])
        return SlopeCells(gx, gy, self._sampling.step, as_normals=False), inconsistent

    def _directions(
        self, pixels: NDArray[Any], marker_mask: Bool | None
    ) -> tuple[Float32, Float32]:
        """Return (K, h, w) linear responses and (3, h, w) unnormalised normals of a frame."""
        response = np.empty_like(self._undeformed)
        for plane, light, exponent in zip(
            self._sampling.planes(pixels, marker_mask), response, self._field.exponents, strict=True
        ):
            if plane.dtype == np.uint8:
                cv2.LUT(plane, self._power(_LEVELS, exponent), dst=light)
            else:
                light[...] = self._power(plane, exponent)
        response *= self._undeformed
        response -= 1
        b = np.zeros((3, *response.shape[1:]), np.float32)
        b[2] = 1
        for component, rows in zip(b, self._rows, strict=True):
            for light, row in zip(response, rows, strict=True):
                cv2.accumulateProduct(light, row, component)
        return response, b

    def _power(self, level: NDArray[Any], exponent: np.float32) -> Float32:
        return np.asarray(np.maximum(level, self._least_level) ** exponent, np.float32)

    def _replace_outliers(
        self, response: Float32, b: Float32, strength: np.float32
    ) -> tuple[NDArray[np.intp], UInt8]:
        """Write the normals of cells in which one light contradicts the others.

        Returns the indices of cells with a highlight, and (h, w) uint8: 1 for cells whose lights
        contradict each other even so.
        """
        inconsistent = np.zeros(b.shape[1:], np.uint8)
        flat = response.reshape(len(response), -1)
        outliers = np.flatnonzero(self._redundancy.misfit(flat) > self._redundancy.tolerance)
        corrected, consistent = self._redundancy.correct_response(flat[:, outliers])
        excess = flat[:, outliers] - corrected
        normals = self._field.directions(corrected, self._place[outliers])
        normals[:2] += strength * self._tilt.reshape(2, -1)[:, outliers]
        b.reshape(3, -1)[:, outliers] = normals
        inconsistent.ravel()[outliers[~consistent]] = 1
        return outliers[excess.max(axis=0) > -excess.min(axis=0)], inconsistent

    def _replace_shaded(self, response: Float32, b: Float32, bright: NDArray[np.intp]) -> None:
        """Write the normals of cells with a dark light and no highlight, from the lit lights."""
        shaded = (response < self._lit_lights.dark_below[:, None, None]).any(axis=0)
        shaded.ravel()[bright] = False
        at = np.flatnonzero(shaded)
        normals = b.reshape(3, -1)
        fitted = normals[:2, at] / np.linalg.norm(normals[:, at], axis=0)
        seen = response.reshape(len(response), -1)[:, at]
        normal_xy = self._lit_lights.beyond(fitted, seen, self._place[at])
        normals[:2, at] = normal_xy
        normals[2, at] = np.sqrt(np.maximum(1 - (normal_xy**2).sum(axis=0), _LEAST_FACING**2))
