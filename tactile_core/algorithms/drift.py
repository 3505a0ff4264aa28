"""The drift of the lights, and the levels of an image."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.coarse_cells import FEWEST_CELLS, Cells, fit_smooth_field


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

    # [logarithm of the gain] Larger changes are no drift and are not compensated. Source: by
    # hand, (10 %, ADR 10).
    largest_log_gain = 0.1
    # [logarithm of the gain] Within twice this a cell is consistent with the gain. Source: twice
    # the 1.5 % noise of a light on the six-LED recordings.
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
    marker_mask : (H, W) bool, optional
        Pixels of the reference that do not show the gel surface.
    """

    def __init__(
        self, reference: Array, full_scale: float, marker_mask: Bool | None = None
    ) -> None:
        self._cells, self._full_scale = Cells(reference.shape[:2]), full_scale
        self._log, self._readable = self._cells.log(reference, full_scale, marker_mask)

    def change(self, pixels: Array, marker_mask: Bool | None = None) -> LightChange | None:
        """Estimate the change of the light in a frame; None if too little of it is readable.

        A constant is fitted to the logarithm of frame over reference, as
        :func:`~tactile_core.algorithms.coarse_cells.fit_smooth_field` does: what a contact changes
        has no weight.
        """
        log, readable = self._cells.log(pixels, self._full_scale, marker_mask)
        change = (log - self._log)[:, readable & self._readable]
        if change.shape[1] < FEWEST_CELLS:
            return None
        constant = np.ones((1, change.shape[1]), np.float32)
        gain = fit_smooth_field(change, constant, (DRIFT.noise_log / np.sqrt(2),) * 3)
        consistent = np.abs(change - gain).max(axis=0) < 2 * DRIFT.noise_log
        return LightChange(gain[:, 0], float(consistent.mean()))


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
