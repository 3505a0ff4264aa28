"""The displacement fields of the last frames of a contact, and how far it moved through them."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

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
    """

    def __init__(self, most: int) -> None:
        self._fields: deque[Complex64] = deque(maxlen=most)

    def __len__(self) -> int:
        return len(self._fields)

    def __getitem__(self, span: int) -> Complex64:
        """Return the field (h, w) of so many frames before the next one; 1 is the last."""
        return self._fields[-span]

    def clear(self) -> None:
        """Forget all fields."""
        self._fields.clear()

    def append(self, field: Complex64) -> None:
        """Keep a copy of the next field, (h, w)."""
        self._fields.append(field.copy())

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
        there = now.ravel()[points]

        def far(span: int) -> float:
            return quantile(np.abs(there - self[span].ravel()[points]), limits.share)

        span, moved_mm = 1, far(1)
        while moved_mm < limits.enough_mm and span < len(self):
            longer_mm = far(span + 1)
            if longer_mm < moved_mm + limits.rest_mm:
                break
            span, moved_mm = span + 1, longer_mm
        return span, moved_mm
