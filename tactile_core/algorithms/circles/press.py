"""One press prepared for circle finding: the colour change at a scale that suits the ball."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.quantile import sigma_of
from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Bool, Float64
from tactile_core.algorithms.levels import LEVELS

BALL_RADIUS_PX = 25.0
"""Larger balls are shrunk to this radius: centres are as good and the work is bounded."""

BLUR_PX = 0.7
DARK_IN_BRIGHT = 0.94
"""Some cameras fold back to dark inside a saturated spot; below this fraction, it is one."""


@dataclass(frozen=True, eq=False)
class PressImage:
    """A frame and the untouched sensor.

    Attributes
    ----------
    pixels, reference : (H, W, K)
        Intensities on one scale.
    full_scale : float
    marker_mask : (H, W) bool or None
        Pixels that show a marker in either.
    """

    pixels: NDArray[Any]
    reference: NDArray[Any]
    full_scale: float = LEVELS.full_scale_8_bit
    marker_mask: Bool | None = None

    @classmethod
    def prepare(
        cls,
        pixels: NDArray[Any],
        reference: NDArray[Any],
        *,
        full_scale: float = LEVELS.full_scale_8_bit,
        marker_mask: Bool | None = None,
        reference_markers: Bool | None = None,
    ) -> Self:
        """Join the markers of frame and reference."""
        both = [mask for mask in (marker_mask, reference_markers) if mask is not None]
        joined = np.logical_or.reduce(both) if both else None
        return cls(pixels, reference, full_scale, joined)


@dataclass(frozen=True, eq=False)
class Change:
    """The colour change of a press at working scale.

    Attributes
    ----------
    values : (h, w, K) float64
        I − I₀ on a scale of 255, smoothed; markers filled.
    weight : (h, w) float64
        0 where a marker or a folded highlight hides the skin.
    full : (h, w, K) bool
        The channel is saturated: the change is at least this.
    noise : float
        Typical length of the change where nothing touches.
    scale : float
        Working pixels per pixel.
    """

    values: Float64
    weight: Float64
    full: Bool
    noise: float
    scale: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the working image."""
        rows, columns = self.weight.shape
        return rows, columns

    def between_channels(self) -> Change:
        """The same without what brightens or darkens all channels alike."""
        return replace(self, values=self.values - self.values.mean(axis=2, keepdims=True))

    def to_working(self, xy: Float64) -> Float64:
        """Points of the image in working pixels."""
        return (xy + 0.5) * self.scale - 0.5

    def to_image(self, xy: Float64) -> Float64:
        """Working pixels in points of the image."""
        return (xy + 0.5) / self.scale - 0.5

    def disc(self, centre: Float64, radius: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Columns and rows of the skin within a radius of a centre."""
        return disc(self.weight, centre, radius)


def disc(
    seen: NDArray[Any], centre: Float64, radius: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Columns and rows within a radius of a centre where an (H, W) mask or weight is not 0."""
    sides = zip(centre, seen.shape[::-1], strict=True)
    box = [np.clip([v - radius, v + radius + 2], 0, side).astype(int) for v, side in sides]
    (x0, x1), (y0, y1) = box
    y, x = np.mgrid[y0:y1, x0:x1]
    inside = ((x - centre[0]) ** 2 + (y - centre[1]) ** 2 < radius**2) & (seen[y, x] > 0)
    return x[inside], y[inside]


def working_scale(ball_radius_px: float) -> float:
    """Working pixels per pixel for a ball of this radius."""
    return min(1.0, BALL_RADIUS_PX / ball_radius_px)


def change_of(press: PressImage, scale: float) -> Change:
    """Shrink a press, subtract the reference, smooth, and mask what is not skin."""
    frame, reference = (
        _shrunk(a, scale, press.full_scale) for a in (press.pixels, press.reference)
    )
    weight = np.ones(frame.shape[:2])
    if press.marker_mask is not None:
        rows, columns, _ = frame.shape
        size = columns, rows
        share = cv2.resize(press.marker_mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        weight[share > 0.1] = 0
    full = frame >= LEVELS.saturation_share * LEVELS.full_scale_8_bit
    for k in range(frame.shape[2]):
        weight[_folded(full[..., k], frame[..., k])] = 0
    change = _masked_blur(frame - reference, weight)
    surface = np.linalg.norm(change, axis=2)[weight > 0]
    noise = sigma_of(surface) + 1e-3 if surface.size else np.inf
    return Change(change, weight, full, noise, scale)


def _shrunk(pixels: NDArray[Any], scale: float, full_scale: float) -> NDArray[Any]:
    image = pixels.astype(np.float32) * np.float32(LEVELS.full_scale_8_bit / full_scale)
    h, w = image.shape[:2]
    if scale == 1:
        return image.astype(np.float64)
    size = max(1, round(w * scale)), max(1, round(h * scale))
    return shrunk(image, size).astype(np.float64)


def _folded(full: Bool, plane: Float64) -> Bool:
    """Dark holes inside a saturated spot."""
    if np.count_nonzero(full) <= 20:
        return np.zeros_like(full)
    kernel = np.ones((5, 5), np.uint8)
    closed = cv2.morphologyEx(full.astype(np.uint8), cv2.MORPH_CLOSE, kernel, iterations=2)
    hole = ((closed > 0) & (plane < DARK_IN_BRIGHT * LEVELS.full_scale_8_bit)).astype(np.uint8)
    return np.asarray(cv2.dilate(hole, np.ones((3, 3), np.uint8)) > 0) & (closed > 0)


def _masked_blur(image: Float64, weight: Float64) -> Float64:
    total = np.maximum(cv2.GaussianBlur(weight, (0, 0), BLUR_PX), 1e-6)
    blurred = cv2.GaussianBlur(image * weight[..., None], (0, 0), BLUR_PX)
    return np.asarray(blurred.reshape(image.shape) / total[..., None])
