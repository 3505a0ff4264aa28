"""Cues of slip in a field of displacement."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from math import hypot, inf, sqrt
from typing import NamedTuple

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


class DEGREE:
    """Parameters of the degree of slip."""

    # [exponent] Exponent of the share of the contact that sticks. Source: by hand, on virtual
    # sequences (ADR 29).
    share_power = 1.5
    # [exponent] The same for a contact wider than the view. The middle of an object, which alone
    # is visible, sticks longest. Source: virtual plates warn at the share at which other objects
    # do (ADR 51).
    wide_share_power = 2.5
    # [ratio] Weight of the deceleration relative to that of the share that slips. Source: chosen
    # on virtual turns: AUC of gross slip 0.86, 0.81 with a weight of 1 (ADR 31).
    deceleration_weight = 2.0
    # [ratio] The same where the surface rather turns: the stick region of a twisted contact
    # decelerates long before it vanishes. Source: virtual turns then reach the degrees of virtual
    # shear (ADR 51).
    turned_weight = 1.0


class Cues(NamedTuple):
    """Cues of slip from the displacement field.

    Attributes
    ----------
    stick_share : float
        Share of the contact that moved with its stick region recently.
    stick_share_drop : float
        Decrease of that share since the previous frame; 0 if it did not decrease.
    deceleration : float
        0 while the stick region moves at its peak speed, 1 when it has stopped.
    motion_mm, rotation_mm : float
        Root mean square over the contact of the rigid motion of the stick region since the load
        settled, and of its rotation alone.
    rotation_rad : float
        Rotation of the stick region since then, positive from x towards y.
    entropy_bits : float
        Entropy of the magnitude of the displacement since then [1]_.
    wide : bool
        Whether the contact is wider than the view.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """

    stick_share: float = 1.0
    stick_share_drop: float = 0.0
    deceleration: float = 0.0
    motion_mm: float = 0.0
    rotation_mm: float = 0.0
    rotation_rad: float = 0.0
    entropy_bits: float = 0.0
    wide: bool = False

    @property
    def turned(self) -> bool:
        """Whether the surface rather turned than shifted."""
        return 2 * self.rotation_mm**2 > self.motion_mm**2

    @property
    def degree(self) -> float:
        """Degree of slip: the share of the contact that slips."""
        return slipped_share(self.evidence, turned=self.turned)

    def std_of(self, degree: float) -> float:
        """Standard deviation of the degree."""
        return slipped_share_std(degree, turned=self.turned, deceleration=self.deceleration)

    @property
    def evidence(self) -> float:
        """Evidence of slip: 0 if the whole contact sticks, 1 if none of it does and motion stopped.

        The stick share is an average over a recent motion, so a decrease is extrapolated to the
        next frame, except for a contact wider than the view: its border is not seen, and its
        share changes abruptly. Once most of the contact slips, the shape of the field hardly
        changes, but the stick region decelerates even though the object does not. Deceleration
        counts only in proportion to the share that slips, so an object that stops while it is held
        well changes little.
        """
        drop = 0.0 if self.wide else self.stick_share_drop
        stick = max(0.0, self.stick_share - drop)
        lost = 1 - math.pow(stick, DEGREE.share_power)
        shown = 1 - math.pow(stick, DEGREE.wide_share_power) if self.wide else lost
        weight = DEGREE.turned_weight if self.turned else DEGREE.deceleration_weight
        return (shown + weight * lost**2 * self.deceleration) / (1 + DEGREE.deceleration_weight)


@dataclass(frozen=True)
class FrictionRecord:
    """What the forces of one contact have shown of its coefficient of friction.

    Attributes
    ----------
    assumed : float or None
        Coefficient until the contact has slipped; None if there is none to assume.
    weight, weighted : float
        Sum of one over the variance of the ratios measured in slip, and of those times the ratios.
    reached : float
        Largest ratio that the contact bore without slipping; the coefficient is no smaller.
    """

    assumed: float | None = None
    weight: float = 0.0
    weighted: float = 0.0
    reached: float = 0.0

    def slipping(self, ratio: float, std: float) -> FrictionRecord:
        """Return the record after a ratio measured in gross slip."""
        weight = 1 / std**2
        return replace(self, weight=self.weight + weight, weighted=self.weighted + weight * ratio)

    def sticking(self, ratio: float, std: float) -> FrictionRecord:
        """Return the record after a ratio measured in stick; noise must not raise the bound."""
        return replace(self, reached=max(self.reached, ratio - std))

    @property
    def coefficient(self) -> float | None:
        """The coefficient of friction; None before slip if none is assumed."""
        if self.weight > 0:
            return self.weighted / self.weight
        return None if self.assumed is None else max(self.assumed, self.reached)

    @property
    def std(self) -> float | None:
        """Standard deviation of a measured coefficient; None if it is assumed."""
        return 1 / sqrt(self.weight) if self.weight > 0 else None


def friction_ratio(fx_n: float, fy_n: float, fz_n: float) -> float:
    """Return shear force over normal force; inf without normal force."""
    return hypot(fx_n, fy_n) / fz_n if fz_n > 0 else inf


def slip_margin(ratio: float, coefficient: float) -> float:
    """Return the share of the greatest shear force that acts, at most 1: ‖Ft‖ ⁄ (µ Fn)."""
    return min(1.0, ratio / coefficient) if coefficient > 0 else 1.0
