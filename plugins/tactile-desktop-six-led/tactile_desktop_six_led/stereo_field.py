"""A light field prepared for one reference, which measures an image in a few milliseconds."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.drift import LEVELS
from tactile_core.algorithms.photometric import place
from tactile_core.algorithms.sampling import Sampling
from tactile_core.algorithms.slope_grid import SlopeCells
from tactile_desktop_six_led.light_drift import LightDrift
from tactile_desktop_six_led.light_field import LIGHT_FIELD, LightField
from tactile_desktop_six_led.lit_lights import LitLights
from tactile_desktop_six_led.press_light import PressLight
from tactile_desktop_six_led.redundancy import Redundancy

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
UInt8 = NDArray[np.uint8]


class STEREO_FIELD:
    """Parameters of measuring entire images. Nothing sets them from outside."""

    # [ratio to the undeformed surface] Lower limit of the unnormalised normal's component towards
    # the camera, 1 on undeformed gel. Smaller values would give unbounded slopes.
    least_facing = 0.2
    # [sine of the slope angle] Steeper pixels count as sloped, in the share that a press has of
    # the image. Source: by hand, above the noise and the apparent tilt of level gel.
    steep_sine = 0.1
    # [count] Rows of the sparse grid of pixels from which drift is estimated. Source: by hand,
    # limits the time per frame.
    drift_rows = 60


_LEAST_FACING = np.float32(STEREO_FIELD.least_facing)
_LEVELS = np.arange(256, dtype=np.float32)


class StereoField:
    """Photometric stereo of one unit relative to one reference. Thread-safe.

    Parameters
    ----------
    field : LightField
    redundancy : Redundancy
    drift : LightDrift
    press_light : PressLight
    lit_lights : LitLights
    reference : (H, W, K) float32
        The undeformed sensor.
    marker_mask : (H, W) bool or None
        Markers of the reference.
    full_scale, blur_px : float
        Largest intensity; standard deviation of the smoothing.
    """

    def __init__(
        self,
        field: LightField,
        redundancy: Redundancy,
        drift: LightDrift,
        press_light: PressLight,
        lit_lights: LitLights,
        reference: Float32,
        marker_mask: Bool | None,
        *,
        full_scale: float,
        blur_px: float,
    ) -> None:
        self._field, self._redundancy, self._drift = field, redundancy, drift
        self._press_light, self._lit_lights = press_light, lit_lights
        self._sampling = Sampling.for_shape(
            (reference.shape[0], reference.shape[1]), marker_mask, blur_px
        )
        base = np.stack(self._sampling.planes(reference, marker_mask)).astype(np.float32)
        lights, height, width = base.shape
        self._place = place((height, width)).reshape(-1, 2)
        # (I / I⁰) ^ e = I ^ e · (I⁰) ^ −e, where the second factor is the same for all frames.
        exponents = field.exponents[:, None, None]
        self._undeformed = (
            np.maximum(base, np.float32(LEVELS.least_divisor_share * full_scale)) ** -exponents
        )
        self._rows = field.rows(self._place).reshape(3, lights, height, width)
        self._tilt = press_light.tilt_at(self._place).reshape(2, height, width)
        step = max(1, min(height, width) // STEREO_FIELD.drift_rows)
        self._sparse = np.s_[step // 2 :: step, step // 2 :: step]
        dark_ratio = (1 + lit_lights.dark_below) ** (1 / field.exponents)
        self._dark_levels = dark_ratio[:, None, None] * base
        self._least_level = np.float32(LIGHT_FIELD.least_ratio * full_scale)
        sparse = (slice(None), *self._sparse)
        self._sparse_undeformed = np.ascontiguousarray(self._undeformed[sparse])
        sparse_rows = self._rows[(slice(None), *sparse)].reshape(3, lights, -1)
        self._sparse_rows = np.ascontiguousarray(sparse_rows)

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
        planes = self._sampling.planes(pixels, marker_mask)
        height, width = self._undeformed.shape[1:]
        slopes = np.empty((2, height, width), np.float32)
        gains, steep_share = self._survey(planes)
        strength = self._press_light.strength(steep_share)
        outliers, response = self._solve(planes, gains, strength, slopes)
        left, highlights = self._correct(outliers, response, strength, slopes)
        self._extrapolate(planes, gains, slopes, highlights)
        inconsistent = np.zeros((height, width), np.uint8)
        inconsistent.ravel()[left] = 1
        gx, gy = slopes
        return SlopeCells(gx, gy, self._sampling.step, as_normals=False), inconsistent

    def survey(
        self, pixels: NDArray[Any], marker_mask: Bool | None = None
    ) -> tuple[Float32, float]:
        """Measure the lights and the share of slopes of a frame (H, W, K).

        Returns
        -------
        gains : (K,) float32
            Brightness of each light relative to calibration.
        steep_share : float
            Share of sloped pixels.
        """
        return self._survey(self._sampling.planes(pixels, marker_mask))

    def _survey(self, planes: list[NDArray[Any]]) -> tuple[Float32, float]:
        sparse = [np.ascontiguousarray(plane[self._sparse]) for plane in planes]
        same = np.ones(len(planes), np.float32)
        response = np.empty_like(self._sparse_undeformed)
        self._respond(sparse, same, self._sparse_undeformed, response)
        flat = response.reshape(len(planes), -1)
        b = np.einsum("jkn,kn->jn", self._sparse_rows, flat)
        b[2] += 1
        normal_xy = b[:2] / np.sqrt(np.einsum("jn,jn->n", b, b))
        steep = np.einsum("jn,jn->n", normal_xy, normal_xy) > STEREO_FIELD.steep_sine**2
        # A shadow on a wall steeper than any calibrated one is not drift.
        lit = self._lit_lights.find_lit(flat).all(axis=0)
        gains = self._drift.gains(flat[:, lit], normal_xy[:, lit], self._redundancy)
        return gains, float(steep.mean())

    def _solve(
        self, planes: list[NDArray[Any]], gains: Float32, strength: np.float32, slopes: Float32
    ) -> tuple[NDArray[np.intp], Float32]:
        """Write (2, H, W) slopes; return indices and responses of inconsistent pixels."""
        shape = self._undeformed.shape
        response, b = np.empty(shape, np.float32), np.empty((3, *shape[1:]), np.float32)
        self._respond(planes, gains, self._undeformed, response)
        np.multiply(self._tilt, strength, out=b[:2])
        b[2] = 1
        for component, rows in zip(b, self._rows, strict=True):
            for light, row in zip(response, rows, strict=True):
                cv2.accumulateProduct(light, row, component)
        np.maximum(b[2], _LEAST_FACING, out=b[2])
        for component, slope in zip(b, slopes, strict=False):
            cv2.divide(component, b[2], dst=slope)
        flat = response.reshape(len(response), -1)
        outliers = np.flatnonzero(self._redundancy.misfit(flat) > self._redundancy.tolerance)
        return outliers, flat[:, outliers]

    def _correct(
        self,
        outliers: NDArray[np.intp],
        response: Float32,
        strength: np.float32,
        slopes: Float32,
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Write slopes of outlier pixels with lights replaced.

        Returns
        -------
        inconsistent, highlights
            The remaining outliers, and the pixels at which a light was too bright.
        """
        if not len(outliers):
            return outliers, outliers
        corrected, consistent = self._redundancy.correct_response(response)
        excess = response - corrected
        too_bright = excess.max(axis=0) > -excess.min(axis=0)
        b = self._field.directions(corrected, self._place[outliers])
        b[:2] += strength * self._tilt.reshape(2, -1)[:, outliers]
        slopes.reshape(2, -1)[:, outliers] = b[:2] / np.maximum(b[2], _LEAST_FACING)
        return outliers[~consistent], outliers[too_bright]

    def _extrapolate(
        self,
        planes: list[NDArray[Any]],
        gains: Float32,
        slopes: Float32,
        highlights: NDArray[np.intp],
    ) -> None:
        """Replace slopes where a light is dark by those of the lit lights, if these are better.

        They must not contain a highlight.
        """
        chosen = np.zeros(slopes.shape[1:], np.bool_)
        for plane, level in zip(planes, self._dark_levels, strict=True):
            chosen |= plane < level
        chosen.ravel()[highlights] = False
        dark = np.flatnonzero(chosen)
        if not len(dark):
            return
        flat = slopes.reshape(2, -1)
        fitted = flat[:, dark] / np.sqrt(1 + (flat[:, dark] ** 2).sum(axis=0))
        response = self._responses_at(dark, planes, gains)
        normal_xy = self._lit_lights.beyond(fitted, response, self._place[dark])
        facing = np.sqrt(np.maximum(1 - (normal_xy**2).sum(axis=0), _LEAST_FACING**2))
        flat[:, dark] = normal_xy / facing

    def _responses_at(
        self, pixels: NDArray[np.intp], planes: list[NDArray[Any]], gains: Float32
    ) -> Float32:
        """Return (K, N) linear responses at flat indices of pixels."""
        levels = np.stack([plane.reshape(-1)[pixels] for plane in planes])
        scaled = self._power(levels / gains[:, None], self._field.exponents[:, None])
        undeformed = self._undeformed.reshape(len(planes), -1)[:, pixels]
        return np.asarray(scaled * undeformed - np.float32(1), np.float32)

    def _respond(
        self, planes: list[NDArray[Any]], gains: Float32, undeformed: Float32, out: Float32
    ) -> None:
        """Write (K, H, W) linear responses relative to the undeformed gel surface."""
        tables = self._power(_LEVELS / gains[:, None], self._field.exponents[:, None])
        for k, (plane, response) in enumerate(zip(planes, out, strict=True)):
            if plane.dtype == np.uint8:
                cv2.LUT(plane, tables[k], dst=response)
            else:
                response[...] = self._power(plane / gains[k], self._field.exponents[k])
        np.multiply(out, undeformed, out=out)
        np.subtract(out, np.float32(1), out=out)

    def _power(self, level: NDArray[Any], exponent: Any) -> Float32:
        return np.asarray(np.maximum(level, self._least_level) ** exponent, np.float32)
