"""A light field prepared for one reference: slopes of whole images in a few milliseconds."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.scratch import borrowed
from tactile_core.algorithms.levels import LEVELS
from tactile_core.algorithms.photometric import place
from tactile_core.algorithms.sampling import Sampling
from tactile_desktop_six_led.light_drift import LightDrift
from tactile_desktop_six_led.light_field import DIMMEST, LightField
from tactile_desktop_six_led.redundancy import Redundancy

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

_LEAST_FACING = np.float32(0.2)
"""Of a skin that faces the camera with 1; less makes slopes without bound."""

_SPARSE_ROWS = 60
"""Drift of the lamps is told by so many rows of pixels."""

_LEVELS = np.arange(256, dtype=np.float32)


class StereoField:
    """Photometric stereo of one unit against one reference.

    Several threads may measure at once.

    Parameters
    ----------
    field : LightField
    redundancy : Redundancy
    drift : LightDrift
    reference : (H, W, K) float32
        The untouched sensor.
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
        reference: Float32,
        marker_mask: Bool | None,
        *,
        full_scale: float,
        blur_px: float,
        compiled: bool = False,
    ) -> None:
        self._compiled = compiled
        self._field, self._redundancy, self._drift = field, redundancy, drift
        self._sampling = Sampling.of((reference.shape[0], reference.shape[1]), marker_mask, blur_px)
        base = np.stack(self._sampling.planes(reference, marker_mask)).astype(np.float32)
        lights, height, width = base.shape
        self._place = place((height, width)).reshape(-1, 2)
        # (I / I⁰) ^ e = I ^ e · (I⁰) ^ −e, of which the second factor is known beforehand.
        exponents = field.exponents[:, None, None]
        self._undeformed = (
            np.maximum(base, np.float32(LEVELS.least_divisor_share * full_scale)) ** -exponents
        )
        self._rows = field.rows(self._place).reshape(3, lights, height, width)
        spots = self._place.reshape(height, width, 2)
        self._columns = spots[:, 0, 1].copy(), field.along_columns(spots[0, :, 0])
        self._dimmest = np.float32(DIMMEST * full_scale)
        step = max(1, min(height, width) // _SPARSE_ROWS)
        self._sparse = np.s_[step // 2 :: step, step // 2 :: step]
        sparse = (slice(None), *self._sparse)
        self._sparse_undeformed = np.ascontiguousarray(self._undeformed[sparse])
        sparse_rows = self._rows[(slice(None), *sparse)].reshape(3, lights, -1)
        self._sparse_rows = np.ascontiguousarray(sparse_rows)

    def measure(
        self, pixels: NDArray[Any], marker_mask: Bool | None = None
    ) -> tuple[Float32, Float32, Bool]:
        """Slopes ∂z/∂x and ∂z/∂y, two (H, W) float32 planes, and where the lamps agree on them.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marker_mask : (H, W) bool, optional
        """
        planes = self._sampling.planes(pixels, marker_mask)
        height, width = self._undeformed.shape[1:]
        with borrowed((2, height, width), np.float32) as sides:
            odd, response = self._solve(planes, self._gains(planes), sides)
            unsure = self._correct(odd, response, sides)
            shape = pixels.shape[0], pixels.shape[1]
            gx, gy = (self._sampling.enlarged(side, shape) for side in sides)
        if not len(unsure):
            return gx, gy, np.ones(shape, np.bool_)
        coarse = np.zeros((height, width), np.uint8)
        coarse.ravel()[unsure] = 1
        return gx, gy, self._sampling.enlarged(coarse, shape) == 0

    def gains(self, pixels: NDArray[Any], marker_mask: Bool | None = None) -> Float32:
        """(K,) brightness of each lamp in (H, W, K) pixels over that at calibration."""
        return self._gains(self._sampling.planes(pixels, marker_mask))

    def _gains(self, planes: list[NDArray[Any]]) -> Float32:
        sparse = [np.ascontiguousarray(plane[self._sparse]) for plane in planes]
        same = np.ones(len(planes), np.float32)
        response = np.empty_like(self._sparse_undeformed)
        self._respond(sparse, same, self._sparse_undeformed, response)
        flat = response.reshape(len(planes), -1)
        b = np.einsum("jkn,kn->jn", self._sparse_rows, flat)
        b[2] += 1
        normal_xy = b[:2] / np.sqrt(np.einsum("jn,jn->n", b, b))
        return self._drift.gains(flat, normal_xy, self._redundancy)

    def _solve(
        self, planes: list[NDArray[Any]], gains: Float32, sides: Float32
    ) -> tuple[NDArray[np.intp], Float32]:
        """Write (2, H, W) slopes; return pixels whose lamps disagree, and their responses."""
        if kernels.chosen(self._compiled) is not None and planes[0].dtype == np.uint8:
            return self._solve_compiled(planes, gains, sides)
        shape = self._undeformed.shape
        with borrowed(shape, np.float32) as response, borrowed((3, *shape[1:]), np.float32) as b:
            self._respond(planes, gains, self._undeformed, response)
            b[:2] = 0
            b[2] = 1
            for component, rows in zip(b, self._rows, strict=True):
                for light, row in zip(response, rows, strict=True):
                    cv2.accumulateProduct(light, row, component)
            np.maximum(b[2], _LEAST_FACING, out=b[2])
            for component, side in zip(b, sides, strict=False):
                cv2.divide(component, b[2], dst=side)
            flat = response.reshape(len(response), -1)
            odd = np.flatnonzero(self._redundancy.misfit(flat) > self._redundancy.tolerance)
            return odd, flat[:, odd]

    def _solve_compiled(
        self, planes: list[NDArray[Any]], gains: Float32, sides: Float32
    ) -> tuple[NDArray[np.intp], Float32]:
        from tactile_desktop_six_led.kernels import solve

        redundancy = self._redundancy.combinations, self._redundancy.tolerance
        tables = self._tables(gains)
        with borrowed(self._undeformed.shape, np.uint8) as stacked:
            np.stack(planes, out=stacked)
            with borrowed(sides.shape[1:], np.bool_) as disagree:
                given = stacked, tables, self._undeformed, self._columns, redundancy
                solve(*given, _LEAST_FACING, sides, disagree)
                odd = np.flatnonzero(disagree)
            levels = stacked.reshape(len(planes), -1)[:, odd]
        lights = np.arange(len(planes))[:, None]
        undeformed = self._undeformed.reshape(len(planes), -1)[:, odd]
        return odd, tables[lights, levels] * undeformed - np.float32(1)

    def _correct(
        self, odd: NDArray[np.intp], response: Float32, sides: Float32
    ) -> NDArray[np.intp]:
        """Write slopes with spoilt lamps replaced at odd pixels; return those that stay odd."""
        if not len(odd):
            return odd
        corrected, sure = self._redundancy.corrected(response)
        b = self._field.directions(corrected, self._place[odd])
        sides.reshape(2, -1)[:, odd] = b[:2] / np.maximum(b[2], _LEAST_FACING)
        return odd[~sure]

    def _respond(
        self, planes: list[NDArray[Any]], gains: Float32, undeformed: Float32, out: Float32
    ) -> None:
        """Write (K, H, W) linear responses less those of the untouched skin."""
        tables = self._tables(gains)
        for k, (plane, response) in enumerate(zip(planes, out, strict=True)):
            if plane.dtype == np.uint8:
                cv2.LUT(plane, tables[k], dst=response)
            else:
                response[...] = self._power(plane / gains[k], self._field.exponents[k])
        np.multiply(out, undeformed, out=out)
        np.subtract(out, np.float32(1), out=out)

    def _tables(self, gains: Float32) -> Float32:
        """(K, 256) powers of the levels of a byte over their lamp's gain."""
        return self._power(_LEVELS / gains[:, None], self._field.exponents[:, None])

    def _power(self, level: NDArray[Any], exponent: Any) -> Float32:
        return np.asarray(np.maximum(level, self._dimmest) ** exponent, np.float32)
