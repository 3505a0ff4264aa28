"""How a motion is cut into steps, and what makes no sense."""

from __future__ import annotations

import numpy as np

from tactile_core.errors import InputError
from tactile_core.sim.contact_state import Pose

QUASI_STATIC_S = np.inf
"""Seconds of a step that is as slow as it takes for all stress to relax."""

_MOST_HOLD_STEPS = 12
_FIRST_HOLD_S = 0.05


def checked_steps(steps: int) -> int:
    """Return the number of steps, or raise an InputError."""
    if steps != int(steps) or steps < 1:
        raise InputError(f"steps should be a whole number of 1 or more, not {steps}")
    return int(steps)


def checked_seconds(seconds: float | None) -> float:
    """Return the seconds, quasi-static for None, or raise an InputError."""
    if seconds is None:
        return QUASI_STATIC_S
    if not (np.isfinite(seconds) and seconds >= 0):
        raise InputError(f"seconds should be 0 or more, not {seconds:g}")
    return float(seconds)


def straight_path(
    start: Pose, dx_mm: float, dy_mm: float, degrees: float, steps: int, seconds: float | None
) -> list[tuple[Pose, float]]:
    """Return places evenly along a motion, and the seconds to get to each from the one before.

    Raises
    ------
    InputError
        A number is not finite, or there are no steps or negative seconds.
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
    """Split a time into steps, each longer than the one before: relaxation is quick at first."""
    if seconds == 0:
        return []
    growth = np.log1p(seconds / _FIRST_HOLD_S)
    count = int(np.clip(np.ceil(seconds / _FIRST_HOLD_S), 1, _MOST_HOLD_STEPS))
    ends = _FIRST_HOLD_S * np.expm1(np.linspace(0, growth, count + 1))
    return [float(step) for step in np.diff(ends)]
