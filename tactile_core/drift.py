"""Light that drifts is followed: each channel is brought back to the level of the reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactile_core.algorithms.drift import channel_gains, divided
from tactile_core.quantities import Frame, Reference

LEAST_DRIFT = 0.002
"""Changes of a channel below it are left alone."""


def followed(frame: Frame, reference: Reference) -> Frame:
    """Return the frame as it would look in the light of the reference.

    See :func:`~tactile_core.algorithms.drift.channel_gains`: nothing is remembered from earlier
    frames, so that a contact that is held for long stays.
    """
    if frame.pixels.shape != reference.pixels.shape or frame.full_scale != reference.full_scale:
        return frame
    gains = channel_gains(frame.pixels, reference.pixels, frame.full_scale, frame.marks)
    if np.abs(gains - 1).max() < LEAST_DRIFT:
        return frame
    return replace(frame, pixels=divided(frame.pixels, gains, frame.full_scale))
