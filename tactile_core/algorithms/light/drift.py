"""The drift of the lights, and the levels of an image."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import shorths
from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Array


class LEVELS:
    """Levels between which an intensity measures light.

    Nothing sets them from outside. A calibration is fitted with these levels and stored without
    them, so a bundle is measured correctly only if they stay the same.
    """

    # [grey levels] Intensity at which an 8-bit channel saturates; the default full scale. Source:
    # the largest unsigned byte, 2⁸ − 1.
    full_scale_8_bit = 255.0
    # [share of the full scale] From this intensity on a channel is saturated: it shows a lower
    # bound of the light. Source: by hand, (252 of 255).
    saturation_share = 0.988
    # [share of the full scale] Up to this intensity a channel is too dark to measure. Source: by
    # hand, (3 of 255).
    dark_share = 0.012
    # [share of the full scale] Reference intensities are raised to this before a frame is divided
    # by them, so that a grey level of noise in the dark is no large relative change. Source: by
    # hand, (10 of 255).
    least_divisor_share = 0.04


class DRIFT:
    """Parameters of the drift estimate.

    Nothing sets them from outside: they are shares and ratios, the same for every sensor. A profile
    or a calibration only chooses whether drift is compensated.
    """

    # [count] Cells of the grid on which frame and reference are compared.
    rows = 24
    columns = 32
    # [logarithm of the gain] Larger changes are no drift and are not compensated. Source: by
    # hand, (10 %, ADR 10).
    largest_log_gain = 0.1
    # [logarithm of the gain] Scale of the biweight; within twice this a cell is consistent with
    # the gain. Source: twice the 1.5 % noise of a light on the six-LED recordings.
    noise_log = 0.03
    # [share of the readable cells] Cells that must be consistent in all channels for the gain to
    # be applied at all, and fully. Source: by hand, (ADR 10).
    least_share = 0.2
    full_share = 0.35


class LightChange(NamedTuple):
    """Change of the light against the reference.

    Attributes
    ----------
    log_ratio : (K,) float32
        Logarithm of the brightness of the undeformed surface over that in the reference.
    share : float
        Share of the readable cells that are consistent with it in all channels.
    """

    log_ratio: Array
    share: float

    @property
    def gains(self) -> Array:
        """(K,) float32: gains to compensate; 1 for a change that is no drift or uncertain."""
        if np.abs(self.log_ratio).max() > DRIFT.largest_log_gain:
            return np.ones(len(self.log_ratio), np.float32)
        range_ = DRIFT.full_share - DRIFT.least_share
        weight = min(max((self.share - DRIFT.least_share) / range_, 0.0), 1.0)
        return np.asarray(np.exp(weight * self.log_ratio), np.float32)

    @property
    def ratio(self) -> Array | None:
        """(K,) float32: the change whatever its size; None if little of the surface agrees."""
        if self.share < DRIFT.least_share:
            return None
        return np.asarray(np.exp(self.log_ratio), np.float32)


class ReferenceLevels:
    """Levels of the reference on a coarse grid, prepared for comparison with many frames.

    Parameters
    ----------
    reference : (H, W, K)
        Image of the undeformed sensor.
    full_scale : float
        The intensity at which a channel saturates.
    """

    def __init__(self, reference: Array, full_scale: float) -> None:
        rows, columns, _ = reference.shape
        self._cells = min(DRIFT.columns, columns), min(DRIFT.rows, rows)
        across, down = (
            np.linspace(0, size - 1, min(size, 2 * cells)).astype(np.intp)
            for size, cells in zip((columns, rows), self._cells, strict=True)
        )
        self._down, self._across = down, across
        self._full_scale = full_scale
        self._undeformed = self._cell_means(reference)
        self._bright = (self._undeformed > LEVELS.dark_share * full_scale).all(axis=0)

    def gains(self, pixels: Array, marker_mask: Array | None = None) -> Array:
        """Estimate each channel's gain in a frame; see :func:`channel_gains`."""
        change = self.change(pixels, marker_mask)
        return np.ones(pixels.shape[2], np.float32) if change is None else change.gains

    def change(self, pixels: Array, marker_mask: Array | None = None) -> LightChange | None:
        """Estimate the change of the light in a frame; None if too little of it is readable."""
        quotients = self._quotients(pixels, marker_mask)
        if quotients.shape[1] < 100:  # [cells] too few for a gain
            return None
        return LightChange(*_undeformed_gain(np.log(quotients)))

    def _quotients(self, pixels: Array, marker_mask: Array | None) -> Array:
        """Means of the readable cells over those of the reference, (K, N) float32."""
        bounds = LEVELS.dark_share * self._full_scale, LEVELS.saturation_share * self._full_scale
        means = self._cell_means(pixels)
        readable = (means.min(axis=0) > bounds[0]) & self._bright
        readable &= means.max(axis=0) < bounds[1]
        if marker_mask is not None:
            readable &= self._cell_means(marker_mask.view(np.uint8)[..., None])[0] == 0
        (index,) = readable.nonzero()
        return np.asarray(means.take(index, axis=1) / self._undeformed.take(index, axis=1))

    def _cell_means(self, pixels: Array) -> Array:
        """Means of neighbouring samples on a coarse grid, (K, N) float32."""
        samples = pixels[np.ix_(self._down, self._across)].astype(np.float32)
        means = shrink_image(samples, self._cells, halvings=0).reshape(-1, pixels.shape[2])
        return np.ascontiguousarray(means.T)


def channel_gains(
    pixels: Array, reference: Array, full_scale: float, marker_mask: Array | None = None
) -> Array:
    """Estimate the gain of each channel against the reference.

    The estimate starts from the mean of the shortest half (the shorth [1]_) of the logarithm of the
    quotient of frame and reference. Tukey's biweight [2]_ refines it on all channels together.

    Parameters
    ----------
    pixels, reference : (H, W, K)
        A frame, and the image of the undeformed sensor.
    full_scale : float
        The intensity at which a channel saturates.
    marker_mask : (H, W) bool, optional
        Pixels that do not show the gel surface.

    Returns
    -------
    (K,) float32
        Within 10 % of 1. Exactly 1 where too little of the surface is undeformed.

    References
    ----------
    .. [1] D. F. Andrews et al., "Robust Estimates of Location: Survey and Advances", Princeton
       University Press, 1972.
    .. [2] A. E. Beaton and J. W. Tukey, "The fitting of power series, meaning polynomials,
       illustrated on band-spectroscopic data", Technometrics 16(2), 1974.
    """
    return ReferenceLevels(reference, full_scale).gains(pixels, marker_mask)


def divide_by_gains(pixels: Array, gains: Array, full_scale: float) -> Array:
    """Divide each channel by its gain. Saturated intensities become the full scale.

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
        tables = np.rint(_compensate_levels(levels[:, None], gains, full_scale)).astype(np.uint8)
        if not planar.flags.c_contiguous:
            return np.asarray(cv2.LUT(pixels, tables[None])).reshape(pixels.shape)
        out = np.empty_like(planar)
        for plane, table, into in zip(planar, tables.T.copy(), out, strict=True):
            cv2.LUT(plane, table, dst=into)
        return out.transpose(1, 2, 0)
    result = _compensate_levels(pixels.astype(np.float32), gains, full_scale)
    return result if pixels.dtype == np.float32 else np.rint(result).astype(pixels.dtype)


def _compensate_levels(levels: Array, gains: Array, full_scale: float) -> Array:
    result = np.clip(levels / np.asarray(gains, np.float32), 0, full_scale)
    return np.where(levels < LEVELS.saturation_share * full_scale, result, np.float32(full_scale))


def _undeformed_gain(logs: Array) -> tuple[Array, float]:
    """Gain of (K, N) logarithms, and the share of samples that are consistent with it."""
    gain = shorths(logs)
    for _ in range(3):  # [reweightings] of the biweight
        residual = logs - gain[:, None]
        residual *= residual
        square = residual.sum(axis=0)
        square *= -1 / (2 * len(logs) * DRIFT.noise_log**2)
        weight = np.maximum(square + 1, 0)
        weight *= weight
        gain = logs @ weight / max(float(weight.sum()), 1e-6)  # no division by zero
    consistent = np.abs(logs - gain[:, None]).max(axis=0) < 2 * DRIFT.noise_log
    return gain, np.count_nonzero(consistent) / logs.shape[1]
