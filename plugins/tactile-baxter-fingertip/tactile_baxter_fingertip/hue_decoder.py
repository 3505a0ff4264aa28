"""Decode the normal from a change of colour: yaw from hue, pitch from saturation and intensity.

This is the principle of the four-colour fingertip [1]_ [2]_. Lights of different colours illuminate
the gel from different sides. The hue of the change therefore gives the direction in which the
surface tilts, and its strength the angle. Before decoding, a matrix that depends on the position
normalises the illumination: it maps the change of colour at each position to the average change
that the same normal causes.

Where a tilt turns the surface towards one light as much as away from the opposite one, the mean
intensity barely changes and does not determine the pitch. The saturation does. The decoder averages
both estimates with weights equal to the inverse of their variances on the calibration presses.

References
----------
.. [1] R. Li, R. Platt, W. Yuan, A. ten Pas, N. Roscup, M. A. Srinivasan and E. H. Adelson,
   "Localization and Manipulation of Small Parts Using GelSight Tactile Sensing", IROS, 2014.
.. [2] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-Resolution Robot Tactile Sensors for
   Estimating Geometry and Force", Sensors 17(12), 2017, section 4.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from tactile_baxter_fingertip.tables import ENTRIES, Bytes, Float32, smooth_table
from tactile_core.algorithms.arrays import regression
from tactile_core.interfaces.slope_models.model_file import part_from

Float = NDArray[np.float64]
PitchFrom = Literal["both", "intensity", "saturation"]

# Rows: two axes of the plane of hue and saturation, and the intensity; orthonormal.
OPPONENT = np.array([[2, -1, -1], [0, 3**0.5, -(3**0.5)], [2**0.5] * 3]) / 6**0.5


# [order] Order of the polynomial in the normal's components that describes the average colour
_COLOUR_ORDER = 5
# [share of the mean diagonal] Ridge penalty of the normalisation matrices
_NORMALISATION_RIDGE = 1e-2
_RANGE_PERCENT = 99.9  # [percent] Percentile of the training colours that the tables span
_RANGE_MARGIN = 1.05  # [ratio] Largest chroma of the tables relative to that percentile
# [relative change] Smallest span of chroma and of intensity: avoids a division by zero for constant
# colours
_LEAST_RANGE = 1e-3
# [squared sine of the pitch] Lower limit of the variance of each estimate: grain, and the
# resolution of the entries
_LEAST_VARIANCE = 2e-4
# [squared sine of the pitch] Lower limit of the variance of the saturation's estimate. It dominates
# where the colour has not changed, where the saturation reliably reports a level surface
_UNCHANGED_VARIANCE = 1e-6


_NEGLIGIBLE_PRECISION = 1e-9  # Precision of an estimate that is switched off: the other one decides

_SHAPES = {
    "evening": (6, 3, 3),
    "limits": (3,),
    "yaw": (ENTRIES, ENTRIES),
    "by_intensity": (ENTRIES, ENTRIES),
    "by_saturation": (ENTRIES, ENTRIES),
}


@dataclass(frozen=True, eq=False)
class HueDecoder:
    """Lookup tables from normalised colour to the normal.

    Attributes
    ----------
    evening : (6, 3, 3) float32
        Normalisation of the illumination: for each of the terms 1, x, y, x², xy and y² of the
        position, a matrix that is applied to (I − I₀) / I₀. The sum of the products gives two
        chroma axes and the intensity.
    limits : (3,) float32
        Largest chroma, smallest and largest intensity of the tables.
    yaw : (256, 256) uint8
        Yaw by both chroma axes, in 256ths of a turn from −180°.
    by_intensity : (256, 256) complex64
        By yaw and intensity: precision of the sine of the pitch (imaginary part), and sine times
        precision (real part).
    by_saturation : (256, 256) complex64
        By yaw and saturation: variance of the ratio of sine and saturation (imaginary part), and
        this ratio (real part), with the saturation in 128ths of the largest. Unlike the sine, the
        ratio stays nearly constant towards level gel, so that averaging does not bias it.
    """

    evening: Float32
    limits: Float32
    yaw: Bytes
    by_intensity: NDArray[np.complex64]
    by_saturation: NDArray[np.complex64]

    def __call__(self, features: Float32) -> Float32:
        """Return normal_xy (N, 2) of (N, 5) relative changes and positions."""
        chroma, intensity = self.entries(normalise_colours(features, self.evening))
        yaw = self.yaw[chroma[:, 0], chroma[:, 1]]
        weighted = self.by_chroma[chroma[:, 0], chroma[:, 1]] + self.by_intensity[yaw, intensity]
        angle = angle_of(yaw)
        sine = weighted.real / weighted.imag
        return np.stack([np.cos(angle) * sine, np.sin(angle) * sine], 1).astype(np.float32)

    @property
    def by_chroma(self) -> NDArray[np.complex64]:
        """(256, 256) complex64: the saturation's estimate by both chroma axes.

        Precision of the sine of the pitch (imaginary part), and sine times precision (real part).
        """
        axis = _centre_entries(np.arange(ENTRIES))
        saturation = np.hypot(axis[:, None], axis)
        ratio = self.by_saturation[self.yaw, _saturation_entry(saturation)]
        precision = 1 / (ratio.imag * saturation**2 + _UNCHANGED_VARIANCE)
        weighted = ratio.real * saturation * precision + 1j * precision
        return np.asarray(weighted, np.complex64)

    @property
    def to_entries(self) -> tuple[Float32, Float32]:
        """(3,) factors and offsets that map chroma axes and intensity to entries."""
        reach, low, high = self.limits
        factors = np.array([128 / reach, 128 / reach, 255 / (high - low)])
        offsets = np.array([128, 128, -low * factors[2]])
        return factors.astype(np.float32), offsets.astype(np.float32)

    def entries(self, colour: Float32) -> tuple[Bytes, Bytes]:
        """Return entries (N, 2) of the chroma and (N,) of the intensity of (N, 3) colours."""
        factors, offsets = self.to_entries
        entries = np.clip(np.rint(colour * factors + offsets), 0, 255).astype(np.uint8)
        return entries[:, :2], entries[:, 2]

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Rebuild a decoder.

        Raises
        ------
        LookupError, ValueError
            An array is missing, misshapen or not finite.
        """
        for name, shape in _SHAPES.items():
            if arrays[name].shape != shape or not np.isfinite(arrays[name]).all():
                raise ValueError(f"{name} does not fit a decoder")
        if arrays["yaw"].dtype != np.uint8:
            raise ValueError("yaw is not an array of bytes")
        return part_from(cls, arrays)


def angle_of(yaw: Bytes) -> Float32:
    """Return the angle of yaw entries in radians."""
    return (np.asarray(yaw, np.float32) - 128) * np.float32(2 * np.pi / ENTRIES)


def normalise_colours(features: Float32, evening: Float32) -> Float32:
    """Return (N, 3) chroma axes and intensity of (N, 5) changes and positions.

    The result is independent of the position's illumination.
    """
    change, terms = features[:, :3], regression.terms(features[:, 3:], 2)
    return np.asarray(np.einsum("nt,tkj,nj->nk", terms, evening, change), np.float32)


def fit_decoder(
    features: Float32, normal_xy: Float32, pitch_from: PitchFrom = "both"
) -> HueDecoder:
    """Fit the tables to pixels with ground-truth slopes.

    Parameters
    ----------
    features : (N, 5) float32
        Relative change of the three channels, and position.
    normal_xy : (N, 2) float32
        Components of the normal along x and y, uphill.
    pitch_from : {"both", "intensity", "saturation"}
        Which strength of the colour determines the pitch, in addition to the yaw.
    """
    evening = _fit_normalisation(features, normal_xy)
    # Rotate the axes so that, to first order, hue is yaw and saturation the sine of the pitch.
    axes = normalise_colours(features, evening)[:, :2].astype(np.float64)
    onto = np.linalg.lstsq(axes, normal_xy.astype(np.float64), rcond=None)[0]
    evening[:, :2] = np.einsum("ak,taj->tkj", onto, evening[:, :2])
    colour = normalise_colours(features, evening)
    percent, least = _RANGE_PERCENT, _LEAST_RANGE
    reach = float(np.percentile(np.hypot(colour[:, 0], colour[:, 1]), percent))
    low, high = np.percentile(colour[:, 2], [100 - percent, percent])
    largest = _RANGE_MARGIN * max(reach, least)
    limits = np.array([largest, low, max(high, low + least)], np.float32)
    negligible = np.full((ENTRIES, ENTRIES), np.complex64(_NEGLIGIBLE_PRECISION * 1j))
    blank = HueDecoder(evening, limits, np.zeros((ENTRIES,) * 2, np.uint8), negligible, negligible)
    chroma, intensity = blank.entries(colour)
    # The angle from hue to yaw varies slowly towards level gel, where hue and yaw are noisy.
    offsets = _centre_entries(chroma)
    seen = offsets[:, 0] + 1j * offsets[:, 1]
    turned = (normal_xy[:, 0] + 1j * normal_xy[:, 1]) * np.conj(seen)
    parts = np.stack([turned.real, turned.imag], 1)
    turn = smooth_table(chroma[:, 0], chroma[:, 1], parts, np.ones(len(parts)))
    axis = _centre_entries(np.arange(ENTRIES))
    hue = np.arctan2(axis, axis[:, None])
    turns = (hue + np.arctan2(turn[..., 1], turn[..., 0])) * (ENTRIES / (2 * np.pi)) + 128
    yaw_table = np.rint(turns).astype(np.int64).astype(np.uint8)
    yaw = yaw_table[chroma[:, 0], chroma[:, 1]]
    # Project on the decoded yaw: where it is unreliable, the projected sine is small, too.
    angle = angle_of(yaw)
    along = (normal_xy[:, 0] * np.cos(angle) + normal_xy[:, 1] * np.sin(angle)).astype(np.float64)
    by_intensity = negligible
    if pitch_from != "saturation":
        mean, variance = _moments(yaw, intensity, along, np.ones(len(along)))
        precision = 1 / (variance + _LEAST_VARIANCE)
        by_intensity = np.asarray(mean * precision + 1j * precision, np.complex64)
    by_saturation = np.full((ENTRIES, ENTRIES), np.complex64(1e9j))
    if pitch_from != "intensity":
        saturation = np.maximum(np.hypot(offsets[:, 0], offsets[:, 1]), 0.5)
        ratio = along / saturation
        entry = _saturation_entry(saturation)
        mean, variance = _moments(yaw, entry, ratio, saturation**2)
        # the lower limit of the sine's variance at half of the largest saturation
        least_variance = _LEAST_VARIANCE / 64**2
        by_saturation = np.asarray(mean + 1j * (variance + least_variance), np.complex64)
    return HueDecoder(evening, limits, yaw_table, by_intensity, by_saturation)


def _fit_normalisation(features: Float32, normal_xy: Float32) -> Float32:
    """Fit the matrices that map the change at a position to the average change of that normal."""
    change = features[:, :3].astype(np.float64)
    order = _COLOUR_ORDER
    powers = range(order + 1)
    nx, ny = normal_xy.astype(np.float64).T
    slope = np.stack([nx**a * ny**b for a in powers for b in powers if a + b <= order], 1)
    average = slope @ np.linalg.lstsq(slope, change, rcond=None)[0]
    terms = regression.terms(features[:, 3:], 2).astype(np.float64)
    products = (terms[:, :, None] * change[:, None, :]).reshape(len(change), -1)
    normal = products.T @ products
    normal += _NORMALISATION_RIDGE * np.trace(normal) / len(normal) * np.eye(len(normal))
    correction = np.linalg.solve(normal, products.T @ (average - change)).reshape(-1, 3, 3)
    correction[0] += np.eye(3)
    return np.asarray(np.einsum("kc,tjc->tkj", OPPONENT, correction), np.float32)


def _moments(yaw: Bytes, entry: Bytes, values: Float, weights: Float) -> tuple[Float32, Float32]:
    """Return mean and variance of values, by yaw and by the strength of the colour change."""
    both = np.stack([values, values**2], 1)
    table = smooth_table(yaw, entry, both, weights, periodic=True)
    mean = table[..., 0]
    return mean, np.maximum(table[..., 1] - mean**2, 0)


def _centre_entries(entries: NDArray[Any]) -> Float:
    return entries.astype(np.float64) - 128


def _saturation_entry(saturation: Float) -> Bytes:
    return np.rint(2 * saturation).clip(0, 255).astype(np.uint8)
