"""Stick, incipient slip, slip: a degree becomes a state that does not chatter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tactile_core.errors import InputError

Name = Literal["none", "stick", "incipient", "slip"]
Kind = Literal["translation", "rotation"]


@dataclass(frozen=True)
class Thresholds:
    """Degrees at which a state begins, and below which it ends.

    Attributes
    ----------
    incipient, slip : float
        Reached from below, the state begins.
    incipient_ends, slip_ends : float
        Under these it ends; lower than the above, so that noise does not make it come and go.

    Raises
    ------
    InputError
        A state would end above where it begins, or slip begin under incipient slip.
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
        ``translation`` or ``rotation``, as it was when the slip began; None while all holds.
    onset_s : float or None
        When the present slip began, incipient or gross; going from one to the other is no new
        beginning.
    """

    thresholds: Thresholds
    name: Name = "none"
    kind: Kind | None = None
    onset_s: float | None = None

    def update(self, degree: float | None, kind: Kind, time_s: float) -> None:
        """Go to the state that this degree asks for.

        Parameters
        ----------
        degree : float or None
            0 to 1; None where nothing touches.
        kind : str
            What it would be if something slips.
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
        """Nothing touches."""
        self.name, self.kind, self.onset_s = "none", None, None
