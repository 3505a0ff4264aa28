"""A light field prepared for one reference: slopes of whole images in a few milliseconds."""

from __future__ import annotations

import threading
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.photometric import DARK_FRACTION, place
from tactile_desktop_six_led.lamp_drift import LampDrift
from tactile_desktop_six_led.light_field import DIMMEST, LightField
from tactile_desktop_six_led.redundancy import Redundancy
from tactile_desktop_six_led.sampling import Sampling

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

_LEAST_FACING = np.float32(0.2)
"""Of a skin that faces the camera with 1; less makes slopes without bound."""

_STEP = 4
"""Every so many pixels lamps are checked against each other; shadows are larger."""

_FEW = np.s_[:, _STEP // 2 :: _STEP, _STEP // 2 :: _STEP]

_SPARSE_ROWS = 60
"""Drift of the lamps is told by so many rows of pixels."""

_LEVELS = np.arange(256, dtype=np.float32)


class StereoField:
    """Photometric stereo of one unit against one reference.

    What depends on the place alone is multiplied out once: with the responses of the untouched
    skin folded into M, a frame costs a table look-up per lamp and 3 K multiply-adds per pixel.

    Parameters
    ----------
    field : LightField
    redundancy : Redundancy
    drift : LampDrift
    reference : (H, W, K) float32
        The untouched sensor.
    marks : (H, W) bool or None
        Marks of the reference.
    full_scale, blur_px : float
        Largest intensity; standard deviation of the smoothing.
    """

    def __init__(
        self,
        field: LightField,
        redundancy: Redundancy,
        drift: LampDrift,
        reference: Float32,
        marks: Bool | None,
        *,
        full_scale: float,
        blur_px: float,
    ) -> None:
        self._field, self._redundancy, self._drift = field, redundancy, drift
        self._sampling = Sampling.of((reference.shape[0], reference.shape[1]), marks, blur_px)
        base = np.stack(self._sampling.planes(reference, marks)).astype(np.float32)
        lamps, height, width = base.shape
        self._place = place((height, width)).reshape(-1, 2)
        # (I / I⁰) ^ e = I ^ e · (I⁰) ^ −e, of which the second factor joins M.
        exponents = field.exponents[:, None, None]
        self._untouched = np.maximum(base, np.float32(DARK_FRACTION * full_scale)) ** -exponents
        self._few_untouched = np.ascontiguousarray(self._untouched[_FEW])
        rows = field.rows(self._place).reshape(3, lamps, height, width)
        self._constant = -rows.sum(1)
        self._constant[2] += 1
        self._weights = rows * self._untouched
        self._dimmest = np.float32(DIMMEST * full_scale)
        step = max(1, min(height, width) // _SPARSE_ROWS)
        self._sparse = np.s_[step // 2 :: step, step // 2 :: step]
        sparse = (slice(None), *self._sparse)
        self._sparse_untouched = np.ascontiguousarray(self._untouched[sparse])
        sparse_rows = rows[(slice(None), *sparse)].reshape(3, lamps, -1)
        self._sparse_rows = np.ascontiguousarray(sparse_rows)
        self._scratch = _Scratch(lamps, height, width)

    def measure(
        self, pixels: NDArray[Any], marks: Bool | None = None
    ) -> tuple[Float32, Float32, Bool]:
        """Slopes ∂z/∂x and ∂z/∂y, two (H, W) float32 planes, and where the lamps agree on them.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marks : (H, W) bool, optional
        """
        planes = self._sampling.planes(pixels, marks)
        gains = self._gains(planes)
        powers = self._powers(planes, gains, self._scratch.powers)
        b = self._directions(powers)
        unsure = np.zeros(b.shape[1:], np.uint8)
        odd = self._odd(powers)
        if len(odd):
            self._mend(odd, b, unsure)
        np.maximum(b[2], _LEAST_FACING, out=b[2])
        shape = pixels.shape[:2]
        gx, gy = (self._sampling.enlarged(cv2.divide(side, b[2]), shape) for side in b[:2])
        return gx, gy, self._sampling.enlarged(unsure, shape) == 0

    def gains(self, pixels: NDArray[Any], marks: Bool | None = None) -> Float32:
        """(K,) brightness of each lamp in (H, W, K) pixels over that at calibration."""
        return self._gains(self._sampling.planes(pixels, marks))

    def _odd(self, powers: Float32) -> NDArray[np.intp]:
        """Flat indices of pixels on which the lamps do not agree."""
        few = powers[_FEW] * self._few_untouched
        few -= 1
        # Most frames have no shadow anywhere, and few pixels tell that.
        if not self._disagree(few).any():
            return np.empty(0, np.intp)
        response = np.multiply(powers, self._untouched, out=self._scratch.response)
        response -= 1
        return np.flatnonzero(self._disagree(response))

    def _disagree(self, response: Float32) -> Bool:
        misfit = self._redundancy.misfit(response.reshape(len(response), -1))
        return np.asarray(misfit > self._redundancy.tolerance)

    def _mend(self, odd: NDArray[np.intp], b: Float32, unsure: NDArray[np.uint8]) -> None:
        """Write the normals of odd pixels, with spoilt lamps replaced, into b."""
        response = self._scratch.response.reshape(len(self._untouched), -1)[:, odd]
        mended, sure = self._redundancy.mended(response)
        unsure.ravel()[odd] = ~sure
        b.reshape(3, -1)[:, odd] = self._field.directions(mended, self._place[odd])

    def _gains(self, planes: list[NDArray[Any]]) -> Float32:
        sparse = [plane[self._sparse] for plane in planes]
        same = np.ones(len(planes), np.float32)
        powers = self._powers(sparse, same, np.empty_like(self._sparse_untouched))
        response = (powers * self._sparse_untouched - 1).reshape(len(planes), -1)
        b = np.einsum("jkn,kn->jn", self._sparse_rows, response)
        b[2] += 1
        sines = b[:2] / np.sqrt(np.einsum("jn,jn->n", b, b))
        return self._drift.gains(response, sines, self._redundancy)

    def _powers(self, planes: list[NDArray[Any]], gains: Float32, out: Float32) -> Float32:
        """(K, H, W) intensities over their lamp's gain, to its exponent."""
        for plane, gain, exponent, power in zip(
            planes, gains, self._field.exponents, out, strict=True
        ):
            if plane.dtype == np.uint8:
                cv2.LUT(plane, self._power(_LEVELS / gain, exponent), dst=power)
            else:
                power[...] = self._power(plane / gain, exponent)
        return out

    def _power(self, level: NDArray[Any], exponent: float) -> Float32:
        return np.asarray(np.maximum(level, self._dimmest) ** exponent, np.float32)

    def _directions(self, powers: Float32) -> Float32:
        """(3, H, W) unnormalised normals; valid until the thread's next call."""
        b = self._scratch.directions
        np.copyto(b, self._constant)
        for component, weights in zip(b, self._weights, strict=True):
            for power, weight in zip(powers, weights, strict=True):
                cv2.accumulateProduct(power, weight, component)
        return b


class _Scratch(threading.local):
    """Buffers of one thread: fresh megabytes for every frame would cost more than the work."""

    def __init__(self, lamps: int, height: int, width: int) -> None:
        self.powers = np.empty((lamps, height, width), np.float32)
        self.response = np.empty((lamps, height, width), np.float32)
        self.directions = np.empty((3, height, width), np.float32)
