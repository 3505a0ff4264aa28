"""What one field after another tells of slip, as a few numbers."""

from __future__ import annotations

from dataclasses import dataclass

_FOLLOWING_POWER = 1.5


@dataclass(frozen=True)
class Cues:
    """What the field tells of slip.

    Attributes
    ----------
    following : float
        Share of the contact that moved with its sticking core lately.
    falling : float
        By how much that share is less than in the frame before; 0 where it is not.
    stalled : float
        0 while the sticking core is carried along as fast as ever, 1 when it has come to a halt.
    motion_mm, turned_mm : float
        Root mean square over the contact of the core's motion since the load settled, and of its
        turn alone.
    turn_rad : float
        By which the core has turned since then, from x towards y.
    entropy_bits : float
        Of the size of the displacement since then [Yuan 2015].
    """

    following: float = 1.0
    falling: float = 0.0
    stalled: float = 0.0
    motion_mm: float = 0.0
    turned_mm: float = 0.0
    turn_rad: float = 0.0
    entropy_bits: float = 0.0

    @property
    def degree(self) -> float:
        """0 where all of the contact follows its core; 1 where none does, and the core has halted.

        The share that follows is averaged over a motion, so that it is taken on to the next frame
        where it falls. Once little follows, the field's shape tells no more, for even the
        middle of a contact that slips wholly is hardly strained; that its core slows down though
        it was just being dragged does. An object that halts while it is held well changes little:
        most of its contact has followed.
        """
        lost = 1 - float(max(0.0, self.following - self.falling) ** _FOLLOWING_POWER)
        return lost * (1 + 2 * lost * self.stalled) / 3
