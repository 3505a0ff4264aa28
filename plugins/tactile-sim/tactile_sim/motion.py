"""Splitting of motions into steps, with validation."""

from __future__ import annotations

import numpy as np

from tactile_core.errors import InputError
from tactile_sim.contact_state import Pose

QUASI_STATIC_S = np.inf  # Duration of a quasi-static step: all stress relaxes


def checked_steps(steps: int) -> int:
    """Return the number of steps, or raise an InputError."""
    if steps != int(steps) or steps < 1:
        raise InputError(f"steps should be a whole number of 1 or more, not {steps}")
    return int(steps)


def checked_seconds(seconds: float | None) -> float:
    """Return the duration, quasi-static for None, or raise an InputError."""
    if seconds is None:
        return QUASI_STATIC_S
    if not (np.isfinite(seconds) and seconds >= 0):
        raise InputError(f"seconds should be 0 or more, not {seconds:g}")
    return float(seconds)


def straight_path(
    start: Pose, dx_mm: float, dy_mm: float, degrees: float, steps: int, seconds: float | None
) -> list[tuple[Pose, float]]:
    """Return evenly spaced poses along a motion, and the duration of each step.

    Raises
    ------
    InputError
        A value is not finite, the number of steps is below 1, or the duration is negative.
    """
    count, duration = checked_steps(steps), checked_seconds(seconds)
    if not np.isfinite([dx_mm, dy_mm, degrees]).all():
        raise InputError("a motion should be a finite number of mm or degrees")
    return [
        (
            Pose(
                start.x_mm + share * dx_mm,
                start.y_mm + share * dy_mm,
                start.angle_deg + share * degrees,
            ),
            duration / count,
        )
        for share in np.arange(1, count + 1) / count
    ]


def slowing_steps(seconds: float) -> list[float]:
    """Split a duration into steps of increasing length, since relaxation is fastest at first."""
    if seconds == 0:
        return []
    first = 0.05  # [s] a shorter hold is a single step
    growth = np.log1p(seconds / first)
    count = int(np.clip(np.ceil(seconds / first), 1, 12))  # [count] at most 12
    ends = first * np.expm1(np.linspace(0, growth, count + 1))
    return [float(step) for step in np.diff(ends)]
