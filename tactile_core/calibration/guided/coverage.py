"""Which colours and places the presses cover, and what a further one teaches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.circle import Circle


class COVERAGE:
    """Parameters of the coverage. Nothing sets them from outside."""

    # [count] Presses that cover the view if each is at the best place. Source: the guide: thirty
    # presses are good; some are lost, and 24 are what five minutes allow.
    presses = 24
    # [share] A view that is covered to this share is complete. Source: by hand: some corners
    # are out of reach of a whole circle.
    complete = 0.85
    # [ball radii] Radii of the contacts that are asked for. Source: what ``tactile calibrate``
    # uses, and the depths of ADR 5.
    contacts: tuple[float, ...] = (0.5, 0.6, 0.7)


class Target(NamedTuple):
    """Where to press next, and until how large the contact is.

    Attributes
    ----------
    centre_px : (float, float)
    contact_radius_px : float
    """

    centre_px: tuple[float, float]
    contact_radius_px: float


class Coverage:
    """Coverage by the presses that are kept.

    Parameters
    ----------
    size_px : (width, height)
    ball_radius_px : float
        That of the flat surface on which the ball would touch as it does.
    """

    def __init__(self, size_px: tuple[int, int], ball_radius_px: float) -> None:
        width, height = size_px
        self._size = np.array(size_px, float)
        self._ball_px = ball_radius_px
        # [count] Cells along the longer side of the view. Source: by hand: half of the distance
        # between 24 places is then two cells.
        side = max(size_px) / 32
        columns, rows = max(1, round(width / side)), max(1, round(height / side))
        x = (np.arange(columns) + 0.5) * width / columns - 0.5
        y = (np.arange(rows) + 0.5) * height / rows - 0.5
        self._x, self._y = np.meshgrid(x, y)
        # radius at which circles in a hexagonal pattern cover the view without gaps
        self._reach_px = max(
            np.sqrt(2 * width * height / (3 * np.sqrt(3) * COVERAGE.presses)),
            COVERAGE.contacts[0] * ball_radius_px,
        )

    def surface(self, kept: Sequence[Circle]) -> Float64:
        """Return how well each cell is covered: 1 within reach of a press, falling to 0."""
        distance = self._distance(kept)
        return np.asarray(np.clip(2 - distance / self._reach_px, 0, 1))

    def slopes(self, kept: Sequence[Circle]) -> Float64:
        """Return (rings, regions) shares of the presses that each ring of steepness should have.

        Regions go from left to right, and from top to bottom.
        """
        # [degrees] Borders of the rings of steepness. Source: by hand, a contact of 0.7 ball radii
        # has slopes up to 44°.
        # [count] Regions along each side of the view, in which slopes are counted. Source: by hand,
        # : light varies over the view about quadratically.
        regions, rings = 3, (0.0, 10.0, 20.0, 30.0, 40.0)
        counts = np.zeros((len(rings) - 1, regions * regions))
        for circle in kept:
            column, row = np.clip(
                regions * (np.asarray(circle.centre_px) + 0.5) / self._size, 0, regions - 1
            ).astype(int)
            share = min(circle.contact_radius_px / self._ball_px, 1.0)
            steepest_deg = np.degrees(np.arcsin(share))
            counts[np.array(rings[:-1]) < steepest_deg - 1, row * regions + column] += 1
        # [count] Presses that have to show slopes of a ring, in each of the regions.
        return np.minimum(counts / 2, 1)

    def is_complete(self, kept: Sequence[Circle]) -> bool:
        """Whether surface and slopes are covered as far as whole circles reach."""
        covered = float((self.surface(kept) >= 1).mean())
        return covered >= COVERAGE.complete and float(self.slopes(kept).mean()) >= COVERAGE.complete

    def is_new(self, place_px: Float64, kept: Sequence[Circle]) -> bool:
        """Whether a place is not that of an earlier press."""
        x, y = place_px
        # [share] A press at a place of an earlier one, closer than this share of the reach, is
        # nothing new.
        near = 0.2 * self._reach_px
        return all(np.hypot(x - k.centre_px[0], y - k.centre_px[1]) > near for k in kept)

    def target(self, kept: Sequence[Circle], missed: Sequence[Target] = ()) -> Target:
        """Choose the place that is farthest from all presses, and the least frequent contact there.

        Parameters
        ----------
        kept : sequence of Circle
        missed : sequence of Target
            Places that were tried in vain since the last press that was kept; others come first.
        """
        share = self._contact(kept)
        contact_px = share * self._ball_px
        margin = contact_px + 3.0  # [px] Distance kept between a contact and the border
        low = np.minimum(margin, (self._size - 1) / 2)
        high = self._size - 1 - low
        # places of whole circles; the cells nearest to the border are pulled inside
        x, y = np.clip(self._x, low[0], high[0]), np.clip(self._y, low[1], high[1])
        distance = np.full(x.shape, np.inf)
        tried = [*(k.centre_px for k in kept), *(m.centre_px for m in missed)]
        for px, py in tried:
            distance = np.minimum(distance, np.hypot(x - px, y - py))
        if not tried:
            distance = -np.hypot(x - self._size[0] / 2, y - self._size[1] / 2)
        row, column = np.unravel_index(int(np.argmax(distance)), distance.shape)
        return Target((float(x[row, column]), float(y[row, column])), float(contact_px))

    def _contact(self, kept: Sequence[Circle]) -> float:
        """Return the contact, in ball radii, that the fewest presses have."""
        shares = [circle.contact_radius_px / self._ball_px for circle in kept]
        contacts = np.array(COVERAGE.contacts)
        nearest = [int(np.argmin(np.abs(contacts - share))) for share in shares]
        counts = np.bincount(nearest, minlength=len(contacts))
        # middle first, then deep: a deep press shows all that a light one does
        order = (1, 2, 0)
        return float(contacts[min(order, key=lambda i: (counts[i], order.index(i)))])

    def _distance(self, kept: Sequence[Circle]) -> Float64:
        distance = np.full(self._x.shape, np.inf)
        for circle in kept:
            x, y = circle.centre_px
            # a contact covers all of itself
            own = np.hypot(self._x - x, self._y - y) - max(
                0.0, circle.contact_radius_px - self._reach_px
            )
            distance = np.minimum(distance, own)
        return distance


# [count] Latest presses whose mean error is the score. Source: by hand: errors of single
# presses differ by half.
_WINDOW = 6


def score_of(errors_deg: Sequence[float]) -> float | None:
    """Return the mean of the latest errors; None without any."""
    latest = errors_deg[-_WINDOW:]
    return float(np.mean(latest)) if len(latest) else None


def still_helps(errors_deg: Sequence[float]) -> bool:
    """Whether the score was still falling between the latest two windows."""
    window = _WINDOW
    if len(errors_deg) < 2 * window:
        return True
    now, before = np.mean(errors_deg[-window:]), np.mean(errors_deg[-2 * window : -window])
    # [ratio] More presses help while the score falls by more than this share from one window to the
    # next. Source: by hand: a third of the accuracy that guided calibration promises.
    return bool(now < (1 - 0.05) * before)
