"""Estimator ``core.friction``: coefficient of friction, and the margin to slip, from the force."""

from __future__ import annotations

from math import hypot

from pydantic import BaseModel

from tactile_core.algorithms.slip.friction import FrictionRecord, friction_ratio, slip_margin
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import Friction, SlipState, Wrench


class FRICTION:
    """Parameters of the step. Nothing sets them from outside."""

    # [count] Normal force in standard deviations below which a ratio says nothing. Source:
    # definition: below that the ratio has no finite mean in practice.
    least_deviations = 3.0
    # [share] Standard deviation of a ratio, relative to its size. Source: virtual rigs: errors of
    # shear and normal force (``experiments/elastic_force.py``).
    ratio_error = 0.07


class FrictionEstimator(Estimator):
    """Measure the coefficient of friction while the contact slips, and the margin while it sticks.

    Before the first slip of a contact its coefficient is ``gel.friction`` of the profile, or what
    the contact has borne if that is larger.
    """

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._record = self._unknown

    @property
    def _unknown(self) -> FrictionRecord:
        return FrictionRecord(self.context.gel.friction)

    def reset(self) -> None:
        """Forget the contact."""
        self._record = self._unknown

    def estimate(self, slip: SlipState, wrench: Wrench) -> Friction:
        """Return the friction; nothing without contact or normal force."""
        std_n = wrench.fz_std_n or 0.0
        if slip.state == "none" or wrench.fz_n <= FRICTION.least_deviations * std_n:
            self.reset()
            return Friction(timestamp_s=wrench.timestamp_s)
        ratio = friction_ratio(wrench.fx_n, wrench.fy_n, wrench.fz_n)
        std = hypot(FRICTION.ratio_error * ratio, (wrench.fx_std_n or 0.0) / wrench.fz_n)
        if slip.state == "slip" and slip.kind == "translation":
            self._record = self._record.slipping(ratio, std)
        elif slip.state in ("stick", "incipient"):
            self._record = self._record.sticking(ratio, std)
        coefficient = self._record.coefficient
        margin = None if coefficient is None else slip_margin(ratio, coefficient)
        return Friction(coefficient, self._record.std, margin, wrench.timestamp_s)
