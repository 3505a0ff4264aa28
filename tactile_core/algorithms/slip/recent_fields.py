"""The displacement fields of the last frames of a contact, and how far it moved through them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.quantile import quantile
from tactile_core.algorithms.arrays.types import Complex64, Intp


class SpanLimits(NamedTuple):
    """What ends the search for the frames of a motion.

    Attributes
    ----------
    share : float
        Quantile of the changes of the points that counts as their motion.
    enough_mm : float
        Motion that is looked for.
    rest_mm : float
        A surface that moved by less in a frame more rested, or turned back.
    """

    share: float
    enough_mm: float
    rest_mm: float


class RecentFields:
    """The last displacement fields of a contact.

    Parameters
    ----------
    most : int
        Number of fields that are kept.
    compiled : bool
        Whether to use the compiled loop if it is available.
    """

    def __init__(self, most: int, *, compiled: bool = False) -> None:
        self._most, self._compiled = most, compiled
        self._ring: Complex64 = np.empty((0, 0, 0), np.complex64)
        self.clear()

    def __len__(self) -> int:
        return self._kept

    def __getitem__(self, span: int) -> Complex64:
        """Return the field (h, w) of so many frames before the next one; 1 is the last."""
        return np.asarray(self._ring[(self._newest + 1 - span) % self._most])

    def clear(self) -> None:
        """Forget all fields."""
        self._newest, self._kept = -1, 0

    def append(self, field: Complex64) -> None:
        """Keep a copy of the next field, (h, w)."""
        if self._ring.shape[1:] != field.shape:
            self._ring = np.empty((self._most, *field.shape), np.complex64)
        self._newest = (self._newest + 1) % self._most
        self._kept = min(self._kept + 1, self._most)
        self._ring[self._newest] = field

    def span(self, now: Complex64, points: Intp, limits: SpanLimits) -> tuple[int, float]:
        """Return the number of frames in which points moved far enough, and how far they moved.

        Fewer if the surface rested or turned back in between.

        Parameters
        ----------
        now : (h, w) complex64
            The next field.
        points : (n,) intp
            Flat indices.
        limits : SpanLimits
        """
        loops = kernels.chosen(self._compiled)
        if loops is not None:
            found: tuple[int, float] = loops.recent_span(
                now, self._ring, self._newest, self._kept, points, tuple(limits)
            )
            return found
        there = now.ravel()[points]

        def far(span: int) -> float:
            return quantile(np.abs(there - self[span].ravel()[points]), limits.share)

        span, moved_mm = 1, far(1)
        while moved_mm < limits.enough_mm and span < self._kept:
            longer_mm = far(span + 1)
            if longer_mm < moved_mm + limits.rest_mm:
                break
            span, moved_mm = span + 1, longer_mm
        return span, moved_mm
