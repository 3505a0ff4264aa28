"""The friction of a contact, from the forces that it bore and at which it slipped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, inf, sqrt


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
