"""How much brighter or darker each channel has become, told from the skin at rest.

One frame and the untouched reference are enough: where the skin rests, the quotient of the two is
the channel's gain, the same in all places, while a contact spreads it. So nothing is remembered,
and a contact that is held for long cannot be absorbed.
"""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.half_sample import narrowest
from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.levels import LEVELS

_ROWS, _COLUMNS = 24, 32
_FEWEST = 100

_MOST = 0.1
"""Logarithm of the gain that is followed; what changes more is no drift."""

_NEAR = 0.03
"""Twice the grain of a channel (1.5 %): skin at rest is this near to the gain."""

_LEAST, _ENOUGH = 0.2, 0.35
"""Shares of the image that must agree in all channels to be believed at all, and fully."""

_ROUNDS = 3
_DARK = 0.02


class ReferenceLevels:
    """The levels of the untouched sensor at a few places, for frames to be compared with.

    Parameters
    ----------
    reference : (H, W, K)
        The untouched sensor.
    full_scale : float
        The intensity at which a channel saturates.
    """

    def __init__(self, reference: Array, full_scale: float) -> None:
        rows, columns, _ = reference.shape
        self._cells = min(_COLUMNS, columns), min(_ROWS, rows)
        across, down = (
            np.linspace(0, size - 1, min(size, 2 * cells)).astype(np.intp)
            for size, cells in zip((columns, rows), self._cells, strict=True)
        )
        self._down, self._across = down, across
        self._places = (down[:, None] * columns + across).ravel()
        self._full_scale = full_scale
        self._undeformed = self._few(reference)
        self._bright = (self._undeformed > _DARK * full_scale).all(axis=0)

    def gains(self, pixels: Array, marker_mask: Array | None = None) -> Array:
        """Estimate each channel's gain in a frame; see :func:`channel_gains`."""
        seen = self._few(pixels)
        good = (seen.min(axis=0) > _DARK * self._full_scale) & self._bright
        good &= seen.max(axis=0) < LEVELS.saturation_share * self._full_scale
        if marker_mask is not None:
            good &= self._few(marker_mask.view(np.uint8)[..., None])[0] == 0
        if np.count_nonzero(good) < _FEWEST:
            return np.ones(pixels.shape[2], np.float32)
        gain, share = _rest_gain(np.log(seen[:, good] / self._undeformed[:, good]))
        if np.abs(gain).max() > _MOST:
            return np.ones(pixels.shape[2], np.float32)
        trust = min(max((share - _LEAST) / (_ENOUGH - _LEAST), 0.0), 1.0)
        return np.asarray(np.exp(trust * gain), np.float32)

    def _few(self, pixels: Array) -> Array:
        """(K, N) float32: means of neighbouring samples on a coarse grid."""
        channels = pixels.shape[2]
        if pixels.flags.c_contiguous:
            some = pixels.reshape(-1, channels).take(self._places, axis=0)
        else:
            some = pixels[np.ix_(self._down, self._across)]
        some = some.reshape(len(self._down), len(self._across), channels).astype(np.float32)
        means = shrunk(some, self._cells, halvings=0).reshape(-1, channels)
        return np.ascontiguousarray(means.T)


def channel_gains(
    pixels: Array, reference: Array, full_scale: float, marker_mask: Array | None = None
) -> Array:
    """Estimate each channel's gain against the reference.

    The mode of the logarithm of each channel's quotient, refined by Tukey's biweight on all
    channels at once.

    Parameters
    ----------
    pixels, reference : (H, W, K)
        A frame and the untouched sensor.
    full_scale : float
        The intensity at which a channel saturates.
    marker_mask : (H, W) bool, optional
        Pixels that do not show the skin.

    Returns
    -------
    (K,) float32
        Within 10 % of 1; exactly 1 where too little of the skin rests to tell.
    """
    return ReferenceLevels(reference, full_scale).gains(pixels, marker_mask)


def divided(pixels: Array, gains: Array, full_scale: float) -> Array:
    """Divide each channel by its gain; saturated intensities stay at the full scale.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    gains : (K,)
    full_scale : float

    Returns
    -------
    (H, W, K), same dtype and layout
    """
    planar = pixels.transpose(2, 0, 1)
    if pixels.dtype == np.uint8:
        levels = np.arange(256, dtype=np.float32)
        tables = np.rint(_steadied(levels[:, None], gains, full_scale)).astype(np.uint8)
        if not planar.flags.c_contiguous:
            return np.asarray(cv2.LUT(pixels, tables[None])).reshape(pixels.shape)
        out = np.empty_like(planar)
        for plane, table, into in zip(planar, tables.T.copy(), out, strict=True):
            cv2.LUT(plane, table, dst=into)
        return out.transpose(1, 2, 0)
    steady = _steadied(pixels.astype(np.float32), gains, full_scale)
    return steady if pixels.dtype == np.float32 else np.rint(steady).astype(pixels.dtype)


def _steadied(levels: Array, gains: Array, full_scale: float) -> Array:
    steady = np.clip(levels / np.asarray(gains, np.float32), 0, full_scale)
    return np.where(levels < LEVELS.saturation_share * full_scale, steady, np.float32(full_scale))


def _rest_gain(logs: Array) -> tuple[Array, float]:
    """Gain of (K, N) logarithms, and the share of them that agrees with it."""
    gain = _modes(logs)
    for _ in range(_ROUNDS):
        square = np.square(logs - gain[:, None]).sum(axis=0)
        weight = np.square(np.maximum(1 - square / (2 * len(logs) * _NEAR**2), 0))
        gain = logs @ weight / max(float(weight.sum()), 1e-6)
    agreeing = np.abs(logs - gain[:, None]).max(axis=0) < 2 * _NEAR
    return gain, np.count_nonzero(agreeing) / logs.shape[1]


def _modes(logs: Array) -> Array:
    """(K,): mean of the shortest interval that holds half of each row."""
    ordered = np.sort(logs, axis=1)
    half = ordered.shape[1] // 2
    first, _ = narrowest(ordered, half + 1)
    return np.array(
        [row[i : i + half].mean() for row, i in zip(ordered, first, strict=True)], np.float32
    )
