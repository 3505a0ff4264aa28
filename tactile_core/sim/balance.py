"""Tangential motion of an object that carries a load: how far it moves until friction holds it."""

from __future__ import annotations

from collections.abc import Callable


class BALANCE:
    """Parameters of the search for a balance of forces. They trade accuracy for time."""

    # [share of the load] Largest difference between load and shear force. Source: twice the error
    # of the shear force in fast mode, whose friction solver has a tolerance of 0.005 of the
    # largest traction.
    tolerance = 0.01
    # [ratio] Factor on a linear extrapolation, because the contact becomes softer as more of it
    # slips. Source: by hand, it affects the number of trials, not the result.
    overshoot = 1.3
    # [count] Largest number of trial steps. Source: by hand, halvings of the longest motion that
    # reach a thousandth of it.
    max_trials = 12


def balanced(
    force_n: Callable[[float], float], load_n: float, *, first_mm: float, at_most_mm: float
) -> float:
    """Return the motion at which the gel's shear force balances a load.

    Expands the motion until the force exceeds the load, then narrows the bracket by regula falsi
    (Illinois). If the force never reaches the load, friction is exceeded and the object moves as
    far as it can.

    Parameters
    ----------
    force_n : callable
        Motion in mm along the load to the shear force against it, N.
    load_n : float
        Positive.
    first_mm : float
        First trial: the motion in which a sticking contact would take up the load.
    at_most_mm : float
        Largest motion along the load. It may move back by any distance.

    Returns
    -------
    float
        Motion along the load, mm; negative if the load has decreased.
    """
    close = BALANCE.tolerance * load_n
    start = force_n(0.0) - load_n
    if abs(start) <= close:
        return 0.0
    sign, limit_mm = (-1.0, float("inf")) if start > 0 else (1.0, at_most_mm)
    if limit_mm == 0:
        return 0.0
    near, near_excess = 0.0, start
    far = sign * min(first_mm, limit_mm)
    trials = 1
    while True:
        trials += 1
        excess = force_n(far) - load_n
        if abs(excess) <= close:
            return far
        if excess * start < 0:
            break
        if abs(far) >= limit_mm or trials >= BALANCE.max_trials:
            return min(far, limit_mm) if sign < 0 else limit_mm
        slope = (excess - near_excess) / (far - near)
        step = BALANCE.overshoot * abs(excess / slope) if slope > 0 else limit_mm
        near, near_excess = far, excess
        far = sign * min(abs(far) + max(step, abs(far)), limit_mm)
    far_excess, side = excess, 0
    while trials < BALANCE.max_trials:
        trials += 1
        middle = (near * far_excess - far * near_excess) / (far_excess - near_excess)
        excess = force_n(middle) - load_n
        if abs(excess) <= close:
            return middle
        if excess * far_excess > 0:
            far, far_excess = middle, excess
            near_excess *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            near, near_excess = middle, excess
            far_excess *= 0.5 if side < 0 else 1.0
            side = -1
    return near if abs(near_excess) < abs(far_excess) else far
