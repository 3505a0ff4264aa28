"""The share of a contact that slips, with its standard deviation, from the evidence of a field."""

from __future__ import annotations

import math

import numpy as np


class SLIPPED_SHARE:
    """Parameters of the slipped share. The evidence of a shift and of a turn differ."""

    # [evidence] Evidence at which a share of 1 - 1/e slips of a contact that shifts, and of one
    # that turns. Source: least squares to the true share of virtual contacts
    # (``benchmarks/slip_speed.py --fit`` with the seeds 0 to 71 and 1000 to 1071, and sequences
    # of ``slip_thresholds.py``, before the tolerance for ringing; a fit today differs a little).
    scale = 0.296
    # [exponent] Exponent of the evidence. Source: as ``scale``.
    shape = 2.29
    turned_scale = 0.308
    turned_shape = 1.51
    # [share] Shares at which the standard deviations are given. Source: means of thirteen classes
    # of these frames.
    knots: tuple[float, ...] = (
        *(0.0, 0.01, 0.03, 0.07, 0.15, 0.25, 0.4),
        *(0.55, 0.7, 0.85, 0.93, 0.97, 1.0),
    )
    # [share of the peak speed] Deceleration above which a contact that shifts is slowing. It
    # either slips as a whole or stops with its object, so that all degrees but the ends are
    # uncertain. Source: as the deceleration above which the stick share no longer grows.
    slowing = 0.4
    # [share] Standard deviation at the knots, for a contact that shifts, that is slowing and that
    # turns: 68 % of the errors in the class are smaller. Source: these frames and the seeds 2000
    # to 2047, validated on others.
    std: tuple[float, ...] = (
        *(0.012, 0.018, 0.046, 0.106, 0.163, 0.195, 0.161),
        *(0.147, 0.16, 0.15, 0.081, 0.035, 0.012),
    )
    slowing_std: tuple[float, ...] = (
        *(0.004, 0.018, 0.043, 0.068, 0.134, 0.237, 0.456),
        *(0.582, 0.713, 0.843, 0.894, 0.858, 0.002),
    )
    turned_std: tuple[float, ...] = (
        *(0.038, 0.015, 0.043, 0.08, 0.121, 0.15, 0.09),
        *(0.088, 0.127, 0.101, 0.054, 0.047, 0.047),
    )


def slipped_share(evidence: float, *, turned: bool) -> float:
    """Return the share of the contact that slips.

    Parameters
    ----------
    evidence : float
        0 while the whole contact sticks; more than about 0.4 when none of it does.
    turned : bool
        Whether the surface rather turns than shifts.
    """
    use = SLIPPED_SHARE
    scale, shape = (use.turned_scale, use.turned_shape) if turned else (use.scale, use.shape)
    return -math.expm1(-((evidence / scale) ** shape))


def slipped_share_std(share: float, *, turned: bool, deceleration: float) -> float:
    """Return the standard deviation of a slipped share.

    Parameters
    ----------
    share : float
    turned : bool
    deceleration : float
        0 while the stick region moves at its peak speed, 1 when it has stopped.
    """
    use = SLIPPED_SHARE
    std = use.slowing_std if deceleration >= use.slowing else use.std
    return float(np.interp(share, use.knots, use.turned_std if turned else std))
