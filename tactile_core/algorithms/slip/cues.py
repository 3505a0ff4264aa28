"""Cues of slip from the displacement fields of a contact, and the degree of slip."""

from __future__ import annotations

import math
from typing import NamedTuple

from tactile_core.algorithms.slip.slipped_share import slipped_share, slipped_share_std


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
