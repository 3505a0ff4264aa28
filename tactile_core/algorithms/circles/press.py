"""One press prepared for circle finding: its log ratio to the reference, at a suitable scale."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import sigma_of
from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64
from tactile_core.algorithms.light.drift import LEVELS

_BLUR_PX = 0.7  # [working px] Standard deviation of the smoothing
# [logarithm of the intensity] Error of the light model; a pixel whose noise is larger counts
# less. Source: by hand, on virtual units (``experiments/circle_finding.py``).
_MODEL_ERROR = 0.025


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
class PressChange:
    """Change of the image by a press at the working scale.

    Attributes
    ----------
    values : (h, w, K) float32
        Logarithm of frame over reference, smoothed; markers are filled. Where the light falls off,
        it changes as much as elsewhere, while the difference vanishes.
    precision : (h, w, K) float32
        Weight of each value, 0 to 1: small where the noise is large relative to the light.
    weight : (h, w) float32
        0 where a marker or a highlight that wrapped to dark hides the gel surface.
    saturated : (h, w, K) bool
        The channel is saturated: the change is a lower bound.
    level : float
        Median intensity of the reference, grey levels of 8 bits.
    grain_px2 : float
        Area over which the noise is correlated, working px².
    scale_xy : (2,) float64
        Working pixels per pixel along x and y. They differ a little, as both sides of the working
        image are whole numbers of pixels.
    """

    values: Float32
    precision: Float32
    weight: Float32
    saturated: Bool
    level: float
    grain_px2: float
    scale_xy: Float64

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: not what is derived from it."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @property
    def scale(self) -> float:
        """Working pixels per pixel, mean of x and y."""
        return float(self.scale_xy.mean())

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the working image."""
        rows, columns = self.weight.shape
        return rows, columns

    def values_at(
        self, columns: NDArray[np.intp], rows: NDArray[np.intp]
    ) -> tuple[Float32, Float32, Bool]:
        """Values, precisions and saturation, (K, N) each, of some pixels."""
        pixels = rows * self.shape[1] + columns
        values, precision, saturated = self._planes
        return values[:, pixels], precision[:, pixels], saturated[:, pixels]

    @cached_property
    def _planes(self) -> tuple[Float32, Float32, Bool]:
        """Values, precisions and saturation, (K, h · w) each."""
        return _planes(self.values), _planes(self.precision), _planes(self.saturated)

    @cached_property
    def weighted(self) -> Float32:
        """(h, w, K) values times the square root of their precision; 0 on markers."""
        return np.asarray(self.values * np.sqrt(self.precision) * self.weight[..., None])

    @cached_property
    def energy(self) -> Float32:
        """(h, w) sum of the squares of :attr:`weighted` over the channels."""
        return np.asarray(np.einsum("ijk,ijk->ij", self.weighted, self.weighted))

    @property
    def noise_variance(self) -> Float32:
        """(h, w, K) variance of :attr:`weighted` by the noise of the camera alone."""
        return np.asarray(_MODEL_ERROR**2 * (1 - self.precision) / self.grain_px2)

    def subtract_drift(self, drift: Float64) -> PressChange:
        """Subtract a change (K,) of the whole image."""
        return replace(self, values=self.values - drift.astype(np.float32))

    def between_channels(self) -> PressChange:
        """Remove the mean of the channels, which brightens or darkens all of them equally."""
        return replace(self, values=self.values - self.values.mean(axis=2, keepdims=True))

    def gradient(self, ball_radius: float) -> PressChange:
        """Gradient of the mean of the channels, (h, w, 2), per ball radius.

        Where the image darkens with depth, it is to depth what the change of the colour is to
        light from the sides: proportional to the slope.
        """
        # [ball radii] Standard deviation of the smoothing before the gradient of the darkening is
        # taken. Source: by hand, on virtual units (``experiments/circle_finding.py``).
        blur_px = 0.08 * ball_radius
        weight = self.precision * self.weight[..., None]
        mean = (self.values * weight).sum(2) / np.maximum(weight.sum(2), 1e-6)
        smooth = _masked_blur(mean[..., None], self.weight, blur_px)[..., 0]
        x, y = (
            cv2.Sobel(smooth, cv2.CV_32F, *way, ksize=1, borderType=cv2.BORDER_REPLICATE)
            for way in ((1, 0), (0, 1))
        )
        along = np.asarray(np.dstack([x, y]) * (ball_radius / 2), np.float32)
        return replace(
            self,
            values=along,
            precision=np.ones_like(along),
            weight=np.asarray(cv2.erode(self.weight, np.ones((3, 3))), np.float32),
            saturated=np.zeros(along.shape, np.bool_),
            grain_px2=_grain_px2(_BLUR_PX, blur_px),
        )

    def to_working(self, xy: Float64) -> Float64:
        """Convert image coordinates to working pixels."""
        return (xy + 0.5) * self.scale_xy - 0.5

    def to_image(self, xy: Float64) -> Float64:
        """Convert working pixels to image coordinates."""
        return (xy + 0.5) / self.scale_xy - 0.5

    def place(self, xy: Float64) -> Float64:
        """Convert working pixels to positions from the middle, in half widths of the image."""
        h, w = self.shape
        return np.asarray((xy + 0.5 - (w / 2, h / 2)) / (w / 2))

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
    x2, y2 = (np.arange(x0, x1) - centre[0]) ** 2, (np.arange(y0, y1) - centre[1]) ** 2
    inside = (y2[:, None] + x2 < radius**2) & (seen[y0:y1, x0:x1] > 0)
    y, x = np.nonzero(inside)
    return x + x0, y + y0


def _planes(image: Array) -> Array:
    """Reshape an (h, w, K) image to (K, h · w)."""
    return np.ascontiguousarray(image.reshape(-1, image.shape[2]).T)


def working_scale(ball_radius_px: float) -> float:
    """Working pixels per pixel for a ball of this radius."""
    # [px] Larger balls are shrunk to this radius. It bounds the time; the centres stay as accurate.
    return min(1.0, 25.0 / ball_radius_px)


def change_of(press: PressImage, scale: float) -> PressChange:
    """Shrink a press, divide it by the reference, mask the markers and smooth."""
    frame, reference = (
        _shrink_pixels(a, scale, press.full_scale) for a in (press.pixels, press.reference)
    )
    weight = np.ones(frame.shape[:2], np.float32)
    if press.marker_mask is not None:
        rows, columns, _ = frame.shape
        size = columns, rows
        share = cv2.resize(press.marker_mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        # [share of a working pixel] With more of its area on markers, a pixel is left out.
        weight[share > 0.1] = 0
    saturated = frame >= LEVELS.saturation_share * LEVELS.full_scale_8_bit
    for k in range(frame.shape[2]):
        weight[_find_dark_holes(saturated[..., k], frame[..., k])] = 0
    # [grey levels of 8 bits] Lower bound of the noise of a pixel: the standard deviation of
    # rounding both images, doubled for what compression and a drifting light add. Source:
    # mathematics, 2 · √(2 / 12), rounded up.
    noise = np.maximum(_pixel_noise(frame - reference), np.float32(1.0))
    undeformed = np.maximum(reference, 0)
    # The noise keeps the divisor finite in the dark, the share the logarithm in shadows.
    # [share of the reference] Added to both intensities before the logarithm, which would dwell on
    # shadows otherwise. Source: by hand, on virtual units (``experiments/circle_finding.py``).
    offset = noise + np.float32(1.0) * undeformed
    ratio = np.log((np.maximum(frame, 0) + offset) / (undeformed + offset))
    relative = noise / (undeformed + offset)
    precision = np.asarray(1 / (1 + (relative / _MODEL_ERROR) ** 2), np.float32)
    return PressChange(
        _masked_blur(ratio, weight, _BLUR_PX),
        precision,
        weight,
        saturated,
        float(np.median(reference)),
        _grain_px2(_BLUR_PX),
        np.divide(weight.shape[::-1], press.reference.shape[1::-1]),
    )


def _pixel_noise(difference: Float32) -> Float32:
    """Standard deviation of the noise of each channel, (K,), from its second differences.

    Anything smooth cancels in d(x − 1) − 2 d(x) + d(x + 1), whose variance is six times the noise.
    """
    # [count] Rows of pixels from which the noise is estimated. Source: by hand, some thousand
    # pixels give a median within some per cent.
    step = max(1, len(difference) // 40)
    second = np.diff(difference[::step], 2, axis=1).reshape(-1, difference.shape[2])
    if not len(second):
        return np.zeros(difference.shape[2], np.float32)
    return np.asarray([sigma_of(plane) / np.sqrt(6) for plane in second.T], np.float32)


def _grain_px2(*blurs_px: float) -> float:
    """Area of the correlation of white noise after Gaussian smoothings."""
    return 1 + 4 * np.pi * sum(blur**2 for blur in blurs_px)


def _shrink_pixels(pixels: NDArray[Any], scale: float, full_scale: float) -> Float32:
    image = pixels.astype(np.float32) * np.float32(LEVELS.full_scale_8_bit / full_scale)
    h, w = image.shape[:2]
    if scale == 1:
        return image
    size = max(1, round(w * scale)), max(1, round(h * scale))
    return shrink_image(image, size)


def _find_dark_holes(saturated: Bool, plane: Float32) -> Bool:
    """Mask of dark holes inside saturated spots."""
    # [px²] Up to this many saturated pixels are not searched for holes
    if np.count_nonzero(saturated) <= 20:
        return np.zeros_like(saturated)
    kernel = np.ones((5, 5), np.uint8)
    closed = cv2.morphologyEx(saturated.astype(np.uint8), cv2.MORPH_CLOSE, kernel, iterations=2)
    # [share of the full scale] Some cameras wrap to dark values inside a saturated spot; a hole
    # below this is such a value.
    dark = plane < 0.94 * LEVELS.full_scale_8_bit
    hole = ((closed > 0) & dark).astype(np.uint8)
    return np.asarray(cv2.dilate(hole, np.ones((3, 3), np.uint8)) > 0) & (closed > 0)


def _masked_blur(image: Float32, weight: Float32, blur_px: float) -> Float32:
    total = np.maximum(cv2.GaussianBlur(weight, (0, 0), blur_px), 1e-6)
    blurred = cv2.GaussianBlur(image * weight[..., None], (0, 0), blur_px)
    return np.asarray(blurred.reshape(image.shape) / total[..., None])
