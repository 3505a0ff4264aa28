"""The markers around each marker of the resting skin, and what they say of its motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.quantile import sigma_of
from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.marker_tracking.nearest import nearest

_NEIGHBOURS = 10
_REACH = 1.3
_TAME = 0.05
"""Keeps slopes small where the neighbours lie to one side, so that borders do not fly off."""


_AMONG = 1.1
"""In pitches: with the middle of its neighbours nearer than this, a marker is among them."""


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """Who is near whom on the resting skin; this never changes while the skin is dragged.

    Attributes
    ----------
    index : (N, K) intp
        The neighbours of each marker, nearest first.
    moments : (N, K, 6) float64
        Weight w, w x, w y, w x², w x y and w y² of each neighbour's place.
    shares : (N, K) float64
        What each neighbour adds to the plane at a marker's place when all are trusted alike.
    offsets : (N, K, 2) float64
        Where each neighbour is from the marker, in pitches.
    pairs : (E, 2) intp
        Every two markers of which one is among the other's neighbours.
    apart : (E,) float64
        Their distance, in pitches.
    pitch_px : float
        Median distance of nearest neighbours.
    nearest_px : (N,) float64
        Distance of each marker's nearest neighbour, at most the pitch.
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.
    """

    index: NDArray[np.intp]
    moments: Array
    shares: Array
    offsets: Array
    pairs: NDArray[np.intp]
    apart: Array
    pitch_px: float
    nearest_px: Array
    compiled: bool = False

    @classmethod
    def of(cls, places_px: Array, *, compiled: bool = False) -> Neighbourhood:
        """Return the neighbourhood of (N, 2) markers; N at least 2."""
        count = len(places_px)
        wanted = min(_NEIGHBOURS, count - 1)
        distance, index = nearest(places_px, places_px, wanted + 1)
        distance, index = distance[:, 1:], index[:, 1:]
        pitch = float(np.median(distance[:, 0]))
        reach = _REACH * distance.max(axis=1, keepdims=True)
        weight = (1 - (distance / reach) ** 2) ** 2
        x, y = np.moveaxis((places_px[index] - places_px[:, None]) / reach[..., None], -1, 0)
        powers = [np.ones_like(x), x, y, x * x + _TAME, x * y, y * y + _TAME]
        one = np.repeat(np.arange(count), wanted)
        lower, upper = np.minimum(one, index.ravel()), np.maximum(one, index.ravel())
        pairs = np.stack(np.divmod(np.unique(lower * count + upper), count), axis=1)
        apart = np.hypot(*(places_px[pairs[:, 0]] - places_px[pairs[:, 1]]).T) / pitch
        moments = np.stack([weight * power for power in powers], axis=-1)
        return cls(
            index,
            moments,
            _shares(moments, np.ones(index.shape)),
            (places_px[index] - places_px[:, None]) / pitch,
            pairs,
            apart,
            pitch,
            np.minimum(distance[:, 0], pitch),
            compiled,
        )

    def room_px(self, places_px: Array) -> Array:
        """Distance of each marker's nearest neighbour, at rest or at (N, 2) places, the lesser."""
        # neighbour by neighbour: a minimum over the first axis is many times faster
        x, y = (side.take(self.index.T) - side for side in (places_px[:, 0], places_px[:, 1]))
        return np.asarray(np.minimum(self.nearest_px, np.sqrt((x * x + y * y).min(axis=0))))

    def fit(self, values: Array, trust: Array) -> Array:
        """What its neighbours let expect of each marker: a plane through theirs, at its place.

        Parameters
        ----------
        values : (N, 2) float64
        trust : (N,) float64
            Weight of each marker as a neighbour, 0 for one that says nothing.

        Returns
        -------
        (N, 2) float64
            0 where no neighbour is trusted.
        """
        loops = kernels.chosen(self.compiled)
        if loops is not None:
            return np.asarray(loops.neighbours_plane(self.index, self.moments, values, trust))
        if trust.all() and trust.min() == trust.max():
            return np.asarray((self.shares[:, None] @ values[self.index])[:, 0])
        trusted = trust[self.index]
        share = _shares(self.moments, trusted)
        return np.asarray((share[:, None] @ values[self.index])[:, 0])

    def deviation(self, values: Array, known: Bool, rounds: int = 2) -> tuple[Array, Array]:
        """What each marker's neighbours let expect, and how far from it the marker is.

        Markers that deviate lose their say over their neighbours, round by round.

        Returns
        -------
        expected : (N, 2) float64
        distance : (N,) float64
        """
        trust = known.astype(np.float64)
        for turn in range(rounds + 1):
            expected = self.fit(values, trust)
            distance = np.hypot(*(values - expected).T)
            if turn == rounds or not known.any():
                break
            scale = max(sigma_of(distance[known]), 0.01 * self.pitch_px)
            trust = known / (1 + (distance / (3 * scale)) ** 2)
        return expected, distance

    def nearby(self, distance: Array, known: Bool) -> Array:
        """Mean (N,) of what is told of the known markers around each; 0 where none is known."""
        counted = known[self.index]
        total = (distance[self.index] * counted).sum(axis=1)
        return np.asarray(total / np.maximum(counted.sum(axis=1), 1))

    def reach_beyond(self, known: Bool) -> Array:
        """By how much worse the known neighbours tell of a marker when they lie to one side, (N,).

        1 while the marker is among them, then as the square of the distance of their middle.
        """
        counted = known[self.index].astype(np.float64)
        middle = (counted[:, None] @ self.offsets)[:, 0]
        distance = np.hypot(middle[:, 0], middle[:, 1]) / np.maximum(counted.sum(axis=1), 1)
        return np.asarray(np.maximum(distance / _AMONG, 1) ** 2)

    def supporters(self, known: Bool) -> NDArray[np.intp]:
        """How many neighbours of each marker are known."""
        return np.asarray(known[self.index].sum(axis=1))

    def agreeing(self, values: Array, known: Bool, most: float, beyond: float = 1.0) -> Bool:
        """Which pairs of known markers differ by less than ``most`` pitches per pitch of distance.

        Pairs up to one pitch apart are all granted the same, those further apart as much as at
        ``beyond`` pitches.
        """
        one, other = self.pairs.T
        difference = np.hypot(*(values[one] - values[other]).T)
        granted = most * self.pitch_px * np.clip(self.apart, 1, beyond)
        return np.asarray(known[one] & known[other] & (difference <= granted))

    def pieces(self, bonds: Bool) -> NDArray[np.int32]:
        """Number the pieces into which the markers fall when only some pairs hold together.

        Parameters
        ----------
        bonds : (E,) bool

        Returns
        -------
        (N,) int32
        """
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        count = len(self.index)
        one, other = self.pairs[bonds].T
        graph = coo_matrix((np.ones(len(one), np.int8), (one, other)), shape=(count, count))
        return np.asarray(connected_components(graph, directed=False)[1])


def _shares(moments: Array, trusted: Array) -> Array:
    """What each neighbour, (N, K) trusted, adds to the plane at a marker's place."""
    one, x, y, xx, xy, yy = (trusted[:, None] @ moments)[:, 0].T
    minors = np.stack([xx * yy - xy * xy, xy * y - x * yy, x * xy - xx * y], axis=-1)
    determinant = one * minors[:, 0] + x * minors[:, 1] + y * minors[:, 2]
    minors /= np.maximum(determinant, 1e-12)[:, None]
    return np.asarray(trusted * (moments[:, :, :3] @ minors[:, :, None])[..., 0])
