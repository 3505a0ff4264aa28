"""Hue and saturation of a change of colour tell the yaw of the normal, intensity its pitch.

The reading of the four-colour fingertip (Li et al. 2014; Yuan, Dong, Adelson 2017, section 4.2):
lights of different colours stand on different sides, so that the colour of the change says to which
side the skin turns, and its strength how far. The place enters first, as a linear map of the three
channels that turns the light of each place into that of the whole image.

The mean intensity hardly changes where a tilt turns as much towards one lamp as away from the
opposite one: there it cannot tell the pitch, and the saturation does. Both are read, each weighted
by how surely it told the pitch of the calibration's balls.
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

OPPONENT = np.array([[2, -1, -1], [0, 3**0.5, -(3**0.5)], [2**0.5] * 3]) / 6**0.5
"""Rows: two axes of the plane of hue and saturation, and the intensity; orthonormal."""

_COLOUR_ORDER = 5
_EVENING_RIDGE = 1e-2
_REACH_PERCENT = 99.9
_MARGIN = 1.05
_SURE = 2e-4
"""Variance of the sine that no reading falls below: grain, and what entries cannot resolve."""

_LEVEL = 1e-6
"""The same where the colour has not changed at all: then the saturation rules."""

_SHAPES = {
    "evening": (6, 3, 3),
    "limits": (3,),
    "yaw": (ENTRIES, ENTRIES),
    "by_intensity": (ENTRIES, ENTRIES),
    "by_saturation": (ENTRIES, ENTRIES),
}


@dataclass(frozen=True, eq=False)
class HueDecoder:
    """Tables from evened colour to the normal.

    Attributes
    ----------
    evening : (6, 3, 3) float32
        For each of the terms 1, x, y, x², xy and y² of the place: the matrix that is applied
        to (I − I₀) / I₀; their sum gives two chroma axes and the intensity.
    limits : (3,) float32
        Largest chroma, smallest and largest intensity that the tables hold.
    yaw : (256, 256) uint8
        Yaw by both chroma axes, in 256ths of a turn from −180°.
    by_intensity : (256, 256) complex64
        By yaw and intensity: precision of the sine of the pitch (imaginary part) and sine times
        precision (real part).
    by_saturation : (256, 256) complex64
        By yaw and saturation: variance of the sine over that of the saturation (imaginary part) and
        sine over saturation (real part), the saturation counted in 128ths of the largest. A ratio,
        for it hardly changes towards level skin, where a mean would not follow the slope to zero.
    """

    evening: Float32
    limits: Float32
    yaw: Bytes
    by_intensity: NDArray[np.complex64]
    by_saturation: NDArray[np.complex64]

    def __call__(self, features: Float32) -> Float32:
        """Sines (N, 2) of (N, 5) relative changes and places; steeper ones stay bounded."""
        chroma, intensity = self.entries(evened(features, self.evening))
        yaw = self.yaw[chroma[:, 0], chroma[:, 1]]
        told = self.by_chroma[chroma[:, 0], chroma[:, 1]] + self.by_intensity[yaw, intensity]
        angle = angle_of(yaw)
        sine = told.real / told.imag
        return np.stack([np.cos(angle) * sine, np.sin(angle) * sine], 1).astype(np.float32)

    @property
    def by_chroma(self) -> NDArray[np.complex64]:
        """(256, 256) complex64: what the saturation tells, by both chroma axes."""
        axis = _centred(np.arange(ENTRIES))
        saturation = np.hypot(axis[:, None], axis)
        ratio = self.by_saturation[self.yaw, _saturation_entry(saturation)]
        precision = 1 / (ratio.imag * saturation**2 + _LEVEL)
        told = ratio.real * saturation * precision + 1j * precision
        return np.asarray(told, np.complex64)

    @property
    def to_entries(self) -> tuple[Float32, Float32]:
        """(3,) factors and offsets from chroma axes and intensity to entries."""
        reach, low, high = self.limits
        factors = np.array([128 / reach, 128 / reach, 255 / (high - low)])
        offsets = np.array([128, 128, -low * factors[2]])
        return factors.astype(np.float32), offsets.astype(np.float32)

    def entries(self, colour: Float32) -> tuple[Bytes, Bytes]:
        """Entries (N, 2) of the chroma and (N,) of the intensity of (N, 3) evened colours."""
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
                raise ValueError(f"{name} is no part of a decoder")
        if arrays["yaw"].dtype != np.uint8:
            raise ValueError("yaw is counted in bytes")
        return part_from(cls, arrays)


def angle_of(yaw: Bytes) -> Float32:
    """Angle in radians of yaw entries."""
    return (np.asarray(yaw, np.float32) - 128) * np.float32(2 * np.pi / ENTRIES)


def evened(features: Float32, evening: Float32) -> Float32:
    """(N, 3) chroma axes and intensity of (N, 5) changes and places, as in the mean light."""
    change, terms = features[:, :3], regression.terms(features[:, 3:], 2)
    return np.asarray(np.einsum("nt,tkj,nj->nk", terms, evening, change), np.float32)


def fit_decoder(
    features: Float32, normal_xy: Float32, pitch_from: PitchFrom = "both"
) -> HueDecoder:
    """Learn the tables from pixels whose slope is known.

    Parameters
    ----------
    features : (N, 5) float32
        Relative change of the three channels, and place.
    normal_xy : (N, 2) float32
    pitch_from : {"both", "intensity", "saturation"}
        What tells the pitch beside the yaw.
    """
    evening = _evening(features, normal_xy)
    # Turned so that to first order the hue is the yaw, and the saturation the sine of the pitch.
    axes = evened(features, evening)[:, :2].astype(np.float64)
    onto = np.linalg.lstsq(axes, normal_xy.astype(np.float64), rcond=None)[0]
    evening[:, :2] = np.einsum("ak,taj->tkj", onto, evening[:, :2])
    colour = evened(features, evening)
    reach = float(np.percentile(np.hypot(colour[:, 0], colour[:, 1]), _REACH_PERCENT))
    low, high = np.percentile(colour[:, 2], [100 - _REACH_PERCENT, _REACH_PERCENT])
    limits = np.array([_MARGIN * max(reach, 1e-3), low, max(high, low + 1e-3)], np.float32)
    silent = np.full((ENTRIES, ENTRIES), np.complex64(1e-9j))
    blank = HueDecoder(evening, limits, np.zeros((ENTRIES,) * 2, np.uint8), silent, silent)
    chroma, intensity = blank.entries(colour)
    # How far the yaw is from the hue changes little towards level skin, where both are unsure.
    offsets = _centred(chroma)
    seen = offsets[:, 0] + 1j * offsets[:, 1]
    turned = (normal_xy[:, 0] + 1j * normal_xy[:, 1]) * np.conj(seen)
    parts = np.stack([turned.real, turned.imag], 1)
    turn = smooth_table(chroma[:, 0], chroma[:, 1], parts, np.ones(len(parts)))
    axis = _centred(np.arange(ENTRIES))
    hue = np.arctan2(axis, axis[:, None])
    turns = (hue + np.arctan2(turn[..., 1], turn[..., 0])) * (ENTRIES / (2 * np.pi)) + 128
    yaw_table = np.rint(turns).astype(np.int64).astype(np.uint8)
    yaw = yaw_table[chroma[:, 0], chroma[:, 1]]
    # Along the yaw that will be read: where that is unsure the sine is read as small as it is.
    angle = angle_of(yaw)
    along = (normal_xy[:, 0] * np.cos(angle) + normal_xy[:, 1] * np.sin(angle)).astype(np.float64)
    by_intensity = silent
    if pitch_from != "saturation":
        mean, variance = _told(yaw, intensity, along, np.ones(len(along)))
        precision = 1 / (variance + _SURE)
        by_intensity = np.asarray(mean * precision + 1j * precision, np.complex64)
    by_saturation = np.full((ENTRIES, ENTRIES), np.complex64(1e9j))
    if pitch_from != "intensity":
        saturation = np.maximum(np.hypot(offsets[:, 0], offsets[:, 1]), 0.5)
        ratio = along / saturation
        entry = _saturation_entry(saturation)
        mean, variance = _told(yaw, entry, ratio, saturation**2)
        by_saturation = np.asarray(mean + 1j * (variance + _SURE / 64**2), np.complex64)
    return HueDecoder(evening, limits, yaw_table, by_intensity, by_saturation)


def _evening(features: Float32, normal_xy: Float32) -> Float32:
    """The matrices that bring each place's change to that which a normal causes on average."""
    change = features[:, :3].astype(np.float64)
    powers = range(_COLOUR_ORDER + 1)
    nx, ny = normal_xy.astype(np.float64).T
    slope = np.stack([nx**a * ny**b for a in powers for b in powers if a + b <= _COLOUR_ORDER], 1)
    usual = slope @ np.linalg.lstsq(slope, change, rcond=None)[0]
    terms = regression.terms(features[:, 3:], 2).astype(np.float64)
    products = (terms[:, :, None] * change[:, None, :]).reshape(len(change), -1)
    normal = products.T @ products
    normal += _EVENING_RIDGE * np.trace(normal) / len(normal) * np.eye(len(normal))
    correction = np.linalg.solve(normal, products.T @ (usual - change)).reshape(-1, 3, 3)
    correction[0] += np.eye(3)
    return np.asarray(np.einsum("kc,tjc->tkj", OPPONENT, correction), np.float32)


def _told(yaw: Bytes, entry: Bytes, values: Float, weights: Float) -> tuple[Float32, Float32]:
    """Mean and variance of values by yaw and by how strongly the colour changed."""
    both = np.stack([values, values**2], 1)
    table = smooth_table(yaw, entry, both, weights, periodic=True)
    mean = table[..., 0]
    return mean, np.maximum(table[..., 1] - mean**2, 0)


def _centred(entries: NDArray[Any]) -> Float:
    return entries.astype(np.float64) - 128


def _saturation_entry(saturation: Float) -> Bytes:
    return np.rint(2 * saturation).clip(0, 255).astype(np.uint8)
