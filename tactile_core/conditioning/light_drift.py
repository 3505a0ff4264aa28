"""Compensation of illumination drift: each channel is scaled back to the reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactile_core.algorithms.drift import ReferenceLevels, divided
from tactile_core.quantities import Frame, Reference


class COMPENSATION:
    """Parameters of the compensation. Nothing sets them from outside: they save time alone."""

    # [ratio] If no gain differs from 1 by more, the frame is not divided. Source: by hand, (ADR
    # 10).
    least_drift = 0.002


class DriftCompensator:
    """Scales frames to the illumination of one reference.

    It keeps nothing from earlier frames, so a contact that is held for long is not absorbed; see
    :class:`~tactile_core.algorithms.drift.ReferenceLevels`.

    Parameters
    ----------
    reference : Reference
    divides : bool
        False only measures the change of the light, as ``Frame.light_ratio``.
    """

    def __init__(self, reference: Reference, *, divides: bool = True) -> None:
        self._reference, self._divides = reference, divides
        self._levels = ReferenceLevels(reference.pixels, reference.full_scale)

    def compensated(self, frame: Frame) -> Frame:
        """Return the frame as it would look under the illumination of the reference."""
        reference = self._reference
        if (frame.pixels.shape, frame.full_scale) != (reference.pixels.shape, reference.full_scale):
            return frame
        change = self._levels.change(frame.pixels, frame.marker_mask)
        if change is None:
            return frame
        gains = change.gains
        if not self._divides or np.abs(gains - 1).max() < COMPENSATION.least_drift:
            return frame.beside(light_ratio=change.ratio)
        pixels = divided(frame.pixels, gains, frame.full_scale)
        return replace(frame, pixels=pixels, light_ratio=change.ratio)
