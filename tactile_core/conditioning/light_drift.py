"""Light that drifts is followed: each channel is brought back to the level of the reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactile_core.algorithms.drift import ReferenceLevels, divided
from tactile_core.quantities import Frame, Reference

LEAST_DRIFT = 0.002
"""Changes of a channel below it are left alone."""


class DriftFollower:
    """Brings frames to the light of one reference.

    See :class:`~tactile_core.algorithms.drift.ReferenceLevels`: nothing is remembered from earlier
    frames, so that a contact that is held for long stays.
    """

    def __init__(self, reference: Reference) -> None:
        self._reference = reference
        self._levels = ReferenceLevels(reference.pixels, reference.full_scale)

    def compensated(self, frame: Frame) -> Frame:
        """Return the frame as it would look in the light of the reference."""
        reference = self._reference
        if (frame.pixels.shape, frame.full_scale) != (reference.pixels.shape, reference.full_scale):
            return frame
        gains = self._levels.gains(frame.pixels, frame.marker_mask)
        if np.abs(gains - 1).max() < LEAST_DRIFT:
            return frame
        return replace(frame, pixels=divided(frame.pixels, gains, frame.full_scale))
