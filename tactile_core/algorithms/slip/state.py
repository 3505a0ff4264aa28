"""The state of slip from all cues."""

from __future__ import annotations

from dataclasses import dataclass
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
