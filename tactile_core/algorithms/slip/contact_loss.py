"""Gross slip from a contact that is lost while it should be held.

An object that slides out of a grasp takes its imprint and its shear along. The contact is then
weaker than it was after it settled. The measure needs no reference of the undeformed surface, and
does not depend on the texture of the object, on its shear or on the frame rate.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple


class CONTACT_LOSS:
    """Parameters of the strength of a contact and of its loss."""

    # [pitches] Strain of the marker lattice that counts as no contact. Source: lower quartile of
    # the smallest strains of the fingers in recorded grasps, most of which never show the
    # undeformed surface (``experiments/slip_contact_loss.py``).
    strain = 0.0115
    # [share of the light] Strength of the imprint that counts as no contact. Source: as
    # ``strain``.
    relief = 0.024
    # [s] A contact has settled at the least strength that it keeps for this time, so that a brief
    # touch is not expected to last. Source: by hand, about the time a gripper takes to close.
    settle_s = 0.5
    # [s] Time constant with which the settled strength approaches the present one, so that a
    # relaxing gel is not reported, and the object is forgotten after its loss. Source: by hand:
    # gels relax in seconds; recorded grasps are ranked alike from 1 s on.
    memory_s = 2.0
    # [share of the strength] Loss that counts as slip. Source: half of what held the object.
    lost_share = 0.5
    # [ratio] Strength of the weakest contact that is distinguished from none. Source: definition
    # of the strength.
    weakest = 1.0
    # [ratio] Uncertainty of a strength, because gels differ. Source: difference of the strengths
    # of two gels without contact, each from its own lower quartiles of strain and relief
    # (``experiments/slip_contact_loss.py``).
    uncertainty = 0.5


def contact_strength(
    strain: float | None,
    relief: float,
    *,
    free_strain: float = CONTACT_LOSS.strain,
    free_relief: float = CONTACT_LOSS.relief,
) -> float:
    """Return the strength of a contact, from 0 without contact.

    Strain and relief grow with the indentation, so their squares grow with its elastic energy.

    Parameters
    ----------
    strain : float or None
        From :class:`~tactile_core.algorithms.slip.marker_lattice.MarkerLattice`; None if it
        cannot be measured.
    relief : float
        RMS of the imprint relative to the light:
        :attr:`~tactile_core.quantities.ImprintMotion.strength`.
    free_strain, free_relief : float
        Both without contact. Measured on the sensor at hand if its undeformed surface is known.

    Returns
    -------
    float
        It is 1 for the weakest contact that is distinguished from none.
    """
    square = (relief / free_relief) ** 2 + ((strain or 0.0) / free_strain) ** 2
    return max(square - 1.0, 0.0)


class LossOfStrength(NamedTuple):
    """How much of a settled contact is lost.

    Attributes
    ----------
    strength : float
        Strength of the contact in this frame.
    settled : float
        Strength at which it settled in the last seconds.
    lost : float
        Share of the contact that may be lost: near 0 while a strong contact is as strong as it
        settled, 1 when it is lost. A weak contact can hardly be distinguished from none, so this
        is 1/3 for the weakest even if nothing is lost, and 1 if there never was any: then it is no
        evidence.
    """

    strength: float
    settled: float
    lost: float

    @property
    def known(self) -> bool:
        """Whether a contact had settled, so that its loss is evidence."""
        return self.settled >= CONTACT_LOSS.weakest

    @property
    def slips(self) -> bool:
        """Whether so much of a settled contact is lost that the object slipped."""
        return self.known and self.lost >= CONTACT_LOSS.lost_share


class ContactLossTracker:
    """Follow the strength of the contact of one sensor.

    Parameters
    ----------
    uncertainty : float
        Uncertainty of a strength.
    """

    def __init__(self, uncertainty: float = CONTACT_LOSS.uncertainty) -> None:
        self._uncertainty = uncertainty
        self.reset()

    def reset(self) -> None:
        """Forget the contact."""
        self._recent: deque[tuple[float, float]] = deque()
        self._settled = 0.0
        self._time_s: float | None = None

    def update(self, strength: float, time_s: float) -> LossOfStrength:
        """Take the next frame.

        Parameters
        ----------
        strength : float
            From :func:`contact_strength`.
        time_s : float
            Time of the frame, not before that of the previous one.

        Returns
        -------
        LossOfStrength
            Nothing is lost before the first ``settle_s`` have passed.
        """
        recent, begin_s = self._recent, time_s - CONTACT_LOSS.settle_s
        recent.append((time_s, strength))
        while len(recent) > 1 and recent[1][0] <= begin_s + _ROUNDING_S:
            recent.popleft()
        earlier_s, self._time_s = self._time_s, time_s
        if recent[0][0] > begin_s + _ROUNDING_S:
            return LossOfStrength(strength, 0.0, 0.0)
        kept = min(value for _, value in recent)
        elapsed_s = 0.0 if earlier_s is None else time_s - earlier_s
        fading = math.exp(-elapsed_s / CONTACT_LOSS.memory_s)
        settled = max(self._settled, kept)
        self._settled = kept + fading * (settled - kept)
        lost = 1.0 - strength / (settled + self._uncertainty)
        return LossOfStrength(strength, settled, max(lost, 0.0))


_ROUNDING_S = 1e-6  # Slack for rounded timestamps, s
