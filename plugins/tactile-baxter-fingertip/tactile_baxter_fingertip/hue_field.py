"""A decoder prepared for one reference, which measures the slopes of entire images."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_baxter_fingertip.hue_decoder import HueDecoder, angle_of
from tactile_baxter_fingertip.tables import ENTRIES, Float32
from tactile_core.algorithms.arrays import regression
from tactile_core.algorithms.levels import LEVELS
from tactile_core.algorithms.normal_xy import planes_to_gradient
from tactile_core.algorithms.photometric import Smoothing, place, relative_change

Bool = NDArray[np.bool_]


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
        self._smoothing = Smoothing.of(marker_mask, blur_px)
        base = self.smoothed(reference, marker_mask)
        if light_blur_px:
            spread = (0, 0)
            blurred = cv2.GaussianBlur(base, spread, light_blur_px, borderType=cv2.BORDER_REFLECT)
            base = np.asarray(blurred, np.float32)
        self.base = base
        self.full_scale = full_scale

    def smoothed(self, pixels: NDArray[Any], marker_mask: Bool | None) -> Float32:
        """Return (H, W, 3) float32 smoothed intensities, with markers filled in."""
        # Rounding the averages to bytes would double their noise.
        return np.asarray(
            self._smoothing.apply(np.asarray(pixels, np.float32), marker_mask), np.float32
        )

    def features(
        self,
        pixels: NDArray[Any],
        marker_mask: Bool | None,
        rows: NDArray[np.int32],
        columns: NDArray[np.int32],
    ) -> Float32:
        """Return (N, 5) relative changes and positions of N pixels."""
        smoothed, base = self.smoothed(pixels, marker_mask)[rows, columns], self.base[rows, columns]
        change = relative_change(smoothed, base, full_scale=self.full_scale)
        return np.concatenate([change, place(pixels.shape[:2])[rows, columns]], axis=1)


class HueField:
    """Decodes entire images, plane by plane; equivalent to :class:`HueDecoder`."""

    def __init__(self, decoder: HueDecoder, light: ReferenceLight) -> None:
        self._light = light
        factors, offsets = decoder.to_entries
        h, w = light.base.shape[:2]
        terms = regression.terms(place((h, w)).reshape(-1, 2), 2).reshape(h, w, -1)
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

    def measure(self, pixels: NDArray[Any], marker_mask: Bool | None) -> tuple[Float32, Float32]:
        """Return the slopes ∂z/∂x and ∂z/∂y, two (H, W) float32 planes."""
        channels = cv2.split(self._light.smoothed(pixels, marker_mask))
        bytes_ = []
        nothing = np.zeros(1)
        for weights, offset in zip(self._weights, self._offsets, strict=True):
            total = offset.copy()
            for channel, weight in zip(channels, weights, strict=True):
                cv2.accumulateProduct(channel, weight, total)
            bytes_.append(cv2.add(total, nothing, dtype=cv2.CV_8U))
        first, second, intensity = bytes_
        chroma = _pair(first, second)
        yaw = self._yaw.take(chroma)
        weighted = self._by_chroma.take(chroma)
        weighted += self._by_intensity.take(_pair(yaw, intensity))
        normal_xy = self._direction.take(yaw)
        normal_xy *= weighted.real / weighted.imag
        gx, gy = (np.ascontiguousarray(part) for part in (normal_xy.real, normal_xy.imag))
        planes_to_gradient(gx, gy, np.empty_like(gx))
        return gx, gy


def _pair(low: NDArray[Any], high: NDArray[Any]) -> NDArray[np.uint16]:
    """Combine two (H, W) planes of bytes into 16-bit indices."""
    return np.asarray(cv2.merge([low, high])).view("<u2")[..., 0]
