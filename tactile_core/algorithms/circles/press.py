"""One press prepared for circle finding: its colour change at a scale that suits the ball."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.quantile import sigma_of
from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Bool, Float64
from tactile_core.algorithms.levels import LEVELS


class PressParameters(NamedTuple):
    """Parameters of the preparation of presses.

    Nothing sets them from outside: the working scale makes them independent of the sensor.

    Attributes
    ----------
    ball_radius_px : float, px
        Larger balls are shrunk to this radius. It bounds the time; the centres stay as accurate.
        Source: chosen by hand; no script derives it.
    blur_px : float, working px
        Standard deviation of the smoothing.
        Source: chosen by hand; no script derives it.
    least_blur_weight : float, ratio
        Lower bound of the sum of weights under the smoothing, against division by zero.
        Source: chosen by hand; no script derives it.
    marker_share : float, share of a working pixel
        With more of its area on markers, a pixel is left out.
        Source: chosen by hand; no script derives it.
    folded_share : float, share of the full scale
        Some cameras wrap to dark values inside a saturated spot; a hole below this is such a value.
        Source: chosen by hand; no script derives it.
    fewest_saturated : int, px²
        Up to this many saturated pixels are not searched for holes.
        Source: chosen by hand; no script derives it.
    least_noise : float, grey levels of 8 bits
        Added to the noise, so that it is positive.
        Source: chosen by hand; no script derives it.
    """

    ball_radius_px: float = 25.0
    blur_px: float = 0.7
    least_blur_weight: float = 1e-6
    marker_share: float = 0.1
    folded_share: float = 0.94
    fewest_saturated: int = 20
    least_noise: float = 1e-3


PRESS = PressParameters()
"""The values in use."""


@dataclass(frozen=True, eq=False)
class PressImage:
    """A frame and its reference.

    Attributes
    ----------
    pixels, reference : (H, W, K)
        Intensities in the same units.
    full_scale : float
        The intensity at which a channel saturates.
    marker_mask : (H, W) bool or None
        Pixels that show a marker in either image.
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
        """Combine the markers of frame and reference."""
        both = [mask for mask in (marker_mask, reference_markers) if mask is not None]
        joined = np.logical_or.reduce(both) if both else None
        return cls(pixels, reference, full_scale, joined)


@dataclass(frozen=True, eq=False)
class Change:
    """Colour change of a press at the working scale.

    Attributes
    ----------
    values : (h, w, K) float64
        I − I₀ in grey levels of 8 bits, smoothed; markers are filled.
    weight : (h, w) float64
        0 where a marker or a highlight that wrapped to dark hides the gel surface.
    saturated : (h, w, K) bool
        The channel is saturated: the change is a lower bound.
    noise : float
        Typical length of the change where nothing touches.
    scale : float
        Working pixels per pixel.
    """

    values: Float64
    weight: Float64
    saturated: Bool
    noise: float
    scale: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the working image."""
        rows, columns = self.weight.shape
        return rows, columns

    def between_channels(self) -> Change:
        """Remove the mean of the channels, which brightens or darkens all of them equally."""
        return replace(self, values=self.values - self.values.mean(axis=2, keepdims=True))

    def to_working(self, xy: Float64) -> Float64:
        """Convert image coordinates to working pixels."""
        return (xy + 0.5) * self.scale - 0.5

    def to_image(self, xy: Float64) -> Float64:
        """Convert working pixels to image coordinates."""
        return (xy + 0.5) / self.scale - 0.5

    def disc(self, centre: Float64, radius: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Columns and rows of the visible gel surface within a radius of a centre."""
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
    return min(1.0, PRESS.ball_radius_px / ball_radius_px)


def change_of(press: PressImage, scale: float) -> Change:
    """Shrink a press, subtract the reference, mask the markers and smooth."""
    frame, reference = (
        _shrunk(a, scale, press.full_scale) for a in (press.pixels, press.reference)
    )
    weight = np.ones(frame.shape[:2])
    if press.marker_mask is not None:
        rows, columns, _ = frame.shape
        size = columns, rows
        share = cv2.resize(press.marker_mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        weight[share > PRESS.marker_share] = 0
    saturated = frame >= LEVELS.saturation_share * LEVELS.full_scale_8_bit
    for k in range(frame.shape[2]):
        weight[_folded(saturated[..., k], frame[..., k])] = 0
    change = _masked_blur(frame - reference, weight)
    surface = np.linalg.norm(change, axis=2)[weight > 0]
    noise = sigma_of(surface) + PRESS.least_noise if surface.size else np.inf
    return Change(change, weight, saturated, noise, scale)


def _shrunk(pixels: NDArray[Any], scale: float, full_scale: float) -> NDArray[Any]:
    image = pixels.astype(np.float32) * np.float32(LEVELS.full_scale_8_bit / full_scale)
    h, w = image.shape[:2]
    if scale == 1:
        return image.astype(np.float64)
    size = max(1, round(w * scale)), max(1, round(h * scale))
    return shrunk(image, size).astype(np.float64)


def _folded(saturated: Bool, plane: Float64) -> Bool:
    """Mask of dark holes inside saturated spots."""
    if np.count_nonzero(saturated) <= PRESS.fewest_saturated:
        return np.zeros_like(saturated)
    kernel = np.ones((5, 5), np.uint8)
    closed = cv2.morphologyEx(saturated.astype(np.uint8), cv2.MORPH_CLOSE, kernel, iterations=2)
    dark = plane < PRESS.folded_share * LEVELS.full_scale_8_bit
    hole = ((closed > 0) & dark).astype(np.uint8)
    return np.asarray(cv2.dilate(hole, np.ones((3, 3), np.uint8)) > 0) & (closed > 0)


def _masked_blur(image: Float64, weight: Float64) -> Float64:
    total = cv2.GaussianBlur(weight, (0, 0), PRESS.blur_px)
    total = np.maximum(total, PRESS.least_blur_weight)
    blurred = cv2.GaussianBlur(image * weight[..., None], (0, 0), PRESS.blur_px)
    return np.asarray(blurred.reshape(image.shape) / total[..., None])
