"""Wear of the gel: the share of its surface that looks different although nothing touches it."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.levels import LEVELS


class WearParameters(NamedTuple):
    """Parameters of the wear estimate.

    Attributes
    ----------
    samples : int, count
        Pixels that are compared, on a regular grid. Source: a share of 2 % is then known to
        ±0.2 % (binomial), at a tenth of the time of all pixels.
    log_change : float, logarithm of the brightness
        Change at a pixel, relative to that of the whole channel, which counts as different.
        Source: the median of five observations of an undamaged gel exceeds it at 0.05 % of the
        pixels at most on the virtual rigs; ten scratches exceed it at 1.5 to 7 %.
    window : int, count
        Observations whose median is compared. Source: an odd number that halves the noise three
        times over.
    fewest : int, count
        Observations out of contact that a pixel needs. Source: see log_change.
    least_seen : float, share of the samples
        Part of the gel that must be seen out of contact for an estimate. Source: half, so that it
        stands for the whole gel.
    """

    samples: int = 8000
    log_change: float = 0.05
    window: int = 15
    fewest: int = 5
    least_seen: float = 0.5


WEAR = WearParameters()
"""The values in use."""


class WearMap:
    """Compares the gel out of contact with the reference, over several observations.

    A pixel is worn if the median of its recent observations out of contact, relative to the change
    of the whole channel, differs from the reference by more than 5 %. More than half of the
    observations then differ in the same direction, so only that is counted.

    Parameters
    ----------
    reference : (H, W, K)
        Image of the undeformed sensor.
    full_scale : float
        The intensity at which a channel saturates.
    marker_mask : (H, W) bool, optional
        Pixels that show a printed marker in the reference.
    """

    def __init__(
        self, reference: Array, full_scale: float, marker_mask: Bool | None = None
    ) -> None:
        height, width = reference.shape[:2]
        self.stride = max(1, round(np.sqrt(height * width / WEAR.samples)))
        self._full_scale = full_scale
        levels = self._sampled(reference)
        self._reference = np.maximum(levels, LEVELS.least_divisor_share * full_scale)
        self._usable = self._is_readable(levels)
        if marker_mask is not None:
            self._usable &= ~self._sampled(marker_mask).astype(bool)
        self._observed: deque[tuple[Array, Bool]] = deque()
        self._above = np.zeros(levels.shape, np.int16)
        self._below = np.zeros(levels.shape, np.int16)
        self._seen = np.zeros(levels.shape[:2], np.int16)

    def add(self, pixels: Array, hidden: Bool | None = None) -> None:
        """Add an observation.

        Parameters
        ----------
        pixels : (H, W, K)
        hidden : (h, w) bool, optional
            Samples that do not show the gel out of contact, on the grid of every ``stride``-th
            pixel.
        """
        levels = self._sampled(pixels)
        seen = self._usable & self._is_readable(levels)
        if hidden is not None:
            seen &= ~hidden
        if not seen.any():
            return
        logs = np.log(levels / self._reference, where=levels > 0, out=np.zeros_like(levels))
        logs -= np.median(logs[seen], axis=0)
        signs = (logs > WEAR.log_change).astype(np.int8) - (logs < -WEAR.log_change)
        signs[~seen] = 0
        self._count(signs, seen, 1)
        self._observed.append((signs, seen))
        if len(self._observed) > WEAR.window:
            self._count(*self._observed.popleft(), -1)

    @property
    def share(self) -> float | None:
        """Worn share of the gel; None while too little of it has been seen out of contact."""
        judged = self._seen >= WEAR.fewest
        if np.count_nonzero(judged) < max(1.0, WEAR.least_seen * np.count_nonzero(self._usable)):
            return None
        most = 2 * np.maximum(self._above, self._below).max(axis=2)
        return float(np.count_nonzero(judged & (most > self._seen)) / np.count_nonzero(judged))

    def _count(self, signs: Array, seen: Bool, weight: int) -> None:
        self._above += weight * (signs > 0)
        self._below += weight * (signs < 0)
        self._seen += weight * seen

    def _sampled(self, pixels: Array) -> Array:
        half = self.stride // 2
        return np.asarray(pixels[half :: self.stride, half :: self.stride], np.float32)

    def _is_readable(self, levels: Array) -> Bool:
        dark, bright = LEVELS.least_divisor_share, LEVELS.saturation_share
        return np.asarray(
            (levels.min(axis=2) > dark * self._full_scale)
            & (levels.max(axis=2) < bright * self._full_scale)
        )
