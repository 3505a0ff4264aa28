"""A decoder prepared for one reference, which measures the slopes of entire images."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_baxter_fingertip.hue_correction import CORRECTION, HueCorrection, to_signed
from tactile_baxter_fingertip.hue_decoder import HueDecoder, angle_of
from tactile_baxter_fingertip.tables import ENTRIES, Float32
from tactile_core.algorithms.arrays import regression
from tactile_core.algorithms.arrays.shrinking import interpolate_cells
from tactile_core.algorithms.drift import LEVELS
from tactile_core.algorithms.normals import planes_to_gradient
from tactile_core.algorithms.photometric import place, relative_change
from tactile_core.algorithms.sampling import Sampling
from tactile_core.algorithms.slope_cells import SlopeCells

Bool = NDArray[np.bool_]
Complex64 = NDArray[np.complex64]

SURVEYED_ROWS = 60  # Rows of the sparse grid of pixels from which the share of slopes is estimated

_SIGNED = to_signed(np.arange(ENTRIES)).astype(np.float32)  # Entries of the intensity, from −1 to 1


class ReferenceLight:
    """The illumination of the undeformed sensor, without the grain of its coating.

    The grain moves with the gel surface, so that the grain of the reference differs from that under
    a press. Wide smoothing of the reference leaves the illumination.

    Parameters
    ----------
    reference : (H, W, 3) float32
    marker_mask : (H, W) bool or None
    full_scale : float
    blur_px : float
        Standard deviation of the smoothing of all images.
    light_blur_px : float
        Standard deviation of the additional smoothing of the reference.
    """

    def __init__(
        self,
        reference: Float32,
        marker_mask: Bool | None,
        *,
        full_scale: float,
        blur_px: float,
        light_blur_px: float,
    ) -> None:
        self._sampling = Sampling.for_shape(reference.shape[:2], marker_mask, blur_px)
        base = self.smooth_pixels(reference, marker_mask)
        if light_blur_px:
            sigma = light_blur_px / self.step_px
            base = np.asarray(
                cv2.GaussianBlur(base, (0, 0), sigma, borderType=cv2.BORDER_REFLECT), np.float32
            )
        self.base = base
        self.full_scale = full_scale

    @property
    def step_px(self) -> int:
        """Side in px of a cell of the grid that holds the smoothed images."""
        return self._sampling.step

    def smooth_pixels(self, pixels: NDArray[Any], marker_mask: Bool | None) -> Float32:
        """Return (h, w, 3) float32 smoothed intensities, with markers filled in."""
        # Rounding the averages to bytes would double their noise.
        smoothed = self._sampling.smooth(np.asarray(pixels, np.float32), marker_mask)
        return np.asarray(smoothed, np.float32)

    def features(
        self,
        pixels: NDArray[Any],
        marker_mask: Bool | None,
        rows: NDArray[np.int32],
        columns: NDArray[np.int32],
    ) -> Float32:
        """Return (N, 5) relative changes and positions of N pixels."""
        shape = pixels.shape[:2]
        smoothed, base = (
            np.dstack([interpolate_cells(plane, self.step_px, shape) for plane in cv2.split(image)])
            for image in (self.smooth_pixels(pixels, marker_mask), self.base)
        )
        at = rows, columns
        change = relative_change(smoothed[at], base[at], full_scale=self.full_scale)
        return np.concatenate([change, place(shape)[at]], axis=1)


class HueField:
    """Decodes entire images, plane by plane; equivalent to :func:`correct_normals`."""

    def __init__(
        self, decoder: HueDecoder, correction: HueCorrection, light: ReferenceLight
    ) -> None:
        self._light, self._correction = light, correction
        factors, offsets = decoder.to_entries
        h, w = light.base.shape[:2]
        position = place((h, w)).reshape(-1, 2)
        terms = regression.terms(position, 2).reshape(h, w, -1)
        floor = np.float32(LEVELS.least_divisor_share * light.full_scale)
        per_intensity = 1 / np.maximum(light.base, floor)
        self._weights: list[list[Float32]] = []
        self._offsets: list[Float32] = []
        for k in range(3):
            matrix = terms @ (decoder.evening[:, k] * factors[k])
            self._offsets.append(offsets[k] - matrix.sum(2))
            self._weights.append([np.ascontiguousarray(m) for m in np.dsplit(matrix, 3)])
            for j, weight in enumerate(self._weights[k]):
                weight *= per_intensity[..., j : j + 1]
        # Two bytes (chroma axes, or yaw and intensity) form one 16-bit index.
        self._yaw = decoder.yaw.T.ravel()
        self._by_chroma = decoder.by_chroma.T.ravel()
        self._by_intensity = decoder.by_intensity.T.ravel()
        angle = angle_of(np.arange(ENTRIES, dtype=np.uint8))
        self._direction = np.exp(1j * angle).astype(np.complex64)
        powers = correction.by_chroma(decoder)
        self._powers = [power.T.ravel() for power in powers]
        by_place = correction.correction_at(position).reshape(h, w, 4, 2).transpose(3, 2, 0, 1)
        self._tilt = np.ascontiguousarray(by_place[:, 0])
        self._by_colour = np.ascontiguousarray(by_place[:, 1:]) / factors[:, None, None]
        self._level = -np.tensordot(self._by_colour, offsets, (1, 0)).astype(np.float32)
        step = max(1, min(h, w) // SURVEYED_ROWS)
        self._sparse = np.s_[step // 2 :: step, step // 2 :: step]

    def measure(self, pixels: NDArray[Any], marker_mask: Bool | None) -> SlopeCells:
        """Return the slopes of a frame (H, W, 3)."""
        colour = self._colour(pixels, marker_mask)
        normal_xy = self._decode_colours(colour)
        strength = self._correction.strength(self._steep_share(normal_xy))
        parts = []
        for part, level, tilt, weights in zip(
            (normal_xy.real, normal_xy.imag), self._level, self._tilt, self._by_colour, strict=True
        ):
            total = cv2.scaleAdd(tilt, float(strength), level)
            total += part
            for plane, weight in zip(colour, weights, strict=True):
                cv2.accumulateProduct(plane, weight, total)
            parts.append(total)
        gx, gy = parts
        planes_to_gradient(gx, gy)
        return SlopeCells(gx, gy, self._light.step_px)

    def steep_share(self, pixels: NDArray[Any], marker_mask: Bool | None) -> float:
        """Return the share of sloped pixels of a frame (H, W, 3)."""
        return self._steep_share(self._decode_colours(self._colour(pixels, marker_mask)))

    def _steep_share(self, normal_xy: Complex64) -> float:
        return float((np.abs(normal_xy[self._sparse]) > CORRECTION.steep_sine).mean())

    def _colour(self, pixels: NDArray[Any], marker_mask: Bool | None) -> list[Float32]:
        """Return chroma axes and intensity, in entries of the tables, as three (h, w) planes."""
        channels = cv2.split(self._light.smooth_pixels(pixels, marker_mask))
        planes = []
        for weights, offset in zip(self._weights, self._offsets, strict=True):
            total = offset.copy()
            for channel, weight in zip(channels, weights, strict=True):
                cv2.accumulateProduct(channel, weight, total)
            planes.append(total)
        return planes

    def _decode_colours(self, colour: list[Float32]) -> Complex64:
        """Return the mean of decoder and polynomial: normal_xy as complex numbers."""
        nothing = np.zeros(1)
        first, second, intensity = (
            np.asarray(cv2.add(plane, nothing, dtype=cv2.CV_8U), np.uint8) for plane in colour
        )
        chroma = _pair(first, second)
        yaw = self._yaw.take(chroma)
        weighted = self._by_chroma.take(chroma)
        weighted += self._by_intensity.take(_pair(yaw, intensity))
        normal_xy: Complex64 = self._direction.take(yaw)
        normal_xy *= weighted.real / weighted.imag
        strength = _SIGNED.take(intensity)
        index, found = chroma.astype(np.intp), np.empty_like(normal_xy)
        smooth = self._powers[-1].take(index)
        for power in self._powers[-2::-1]:
            smooth *= strength
            # with a mode other than "raise", values are written without a buffer
            smooth += power.take(index, out=found, mode="clip")
        normal_xy += smooth
        normal_xy *= np.float32(0.5)
        return normal_xy


def _pair(low: NDArray[Any], high: NDArray[Any]) -> NDArray[np.uint16]:
    """Combine two (H, W) planes of bytes into 16-bit indices."""
    return np.asarray(cv2.merge([low, high])).view("<u2")[..., 0]
