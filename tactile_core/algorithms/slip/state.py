"""The state of slip from all cues."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, inf, sqrt
from typing import Literal

from tactile_core.errors import InputError

Name = Literal["none", "stick", "incipient", "slip"]
Kind = Literal["translation", "rotation"]


@dataclass(frozen=True)
class Thresholds:
    """Degrees of slip at which a state begins, and below which it ends.

    Attributes
    ----------
    incipient, slip : float
        The state begins when the degree reaches this threshold.
    incipient_ends, slip_ends : float
        The state ends when the degree falls below this threshold. It is lower than the one above,
        so that noise does not toggle the state.

    Raises
    ------
    InputError
        A state would end above the threshold at which it begins, or slip would begin below
        incipient slip.
    """

    incipient: float
    incipient_ends: float
    slip: float
    slip_ends: float

    def __post_init__(self) -> None:
        if not (
            0 <= self.incipient_ends <= self.incipient <= self.slip
            and self.incipient_ends <= self.slip_ends <= self.slip
        ):
            raise InputError(
                f"slip thresholds must be ordered, incipient_ends ≤ incipient ≤ slip and "
                f"incipient_ends ≤ slip_ends ≤ slip; these are {self.incipient_ends:g}, "
                f"{self.incipient:g}, {self.slip:g} and {self.slip_ends:g} (slip_ends)"
            )


@dataclass
class SlipMachine:
    """The state of one contact.

    Attributes
    ----------
    thresholds : Thresholds
    name : str
    kind : str or None
        ``translation`` or ``rotation``, fixed at the onset of slip; None while the contact sticks.
    onset_s : float or None
        Time at which the current slip began, incipient or gross. A transition between the two
        keeps it.
    """

    thresholds: Thresholds
    name: Name = "none"
    kind: Kind | None = None
    onset_s: float | None = None

    def update(self, degree: float | None, kind: Kind, time_s: float) -> None:
        """Take the state of the next degree.

        Parameters
        ----------
        degree : float or None
            0 to 1; None without contact.
        kind : str
            Kind of the slip if it begins now.
        time_s : float
        """
        if degree is None:
            self.reset()
            return
        slips = self.name in ("incipient", "slip")
        limit = self.thresholds
        if degree >= (limit.slip_ends if self.name == "slip" else limit.slip):
            self.name = "slip"
        elif degree >= (limit.incipient_ends if slips else limit.incipient):
            self.name = "incipient"
        else:
            self.name, self.kind, self.onset_s = "stick", None, None
            return
        if not slips:
            self.kind, self.onset_s = kind, time_s

    def reset(self) -> None:
        """Return to the state without contact."""
        self.name, self.kind, self.onset_s = "none", None, None


class FUSION:
    """Parameters of the fusion."""

    # [share of the imprint's energy] Unexplained change of the imprint at which the object slips,
    # default of an option of ``core.slip``. Source: recorded lifts, each object by the others
    # (``benchmarks/slip_lift_folds.py``).
    imprint_changed = 0.04


def degree_of(evidence: float) -> float:
    """Convert evidence, 0 or more, to a degree: 0.5 where slip begins, below 1."""
    return evidence / (1 + evidence)


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
