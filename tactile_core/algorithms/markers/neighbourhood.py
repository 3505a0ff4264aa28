"""The neighbourhood of each marker, and how it stretches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import sigma_of, terms
from tactile_core.algorithms.arrays.types import Array, Bool, Intp


def nearest(
    places: Array, among: Array, count: int, within: float = np.inf
) -> tuple[Array, NDArray[np.intp]]:
    """Return distances and indices (N, count) of the nearest points of ``among``, nearest first.

    Beyond ``within`` the distance is infinite and the index is ``len(among)``.
    """
    from scipy.spatial import KDTree

    ranks = list(range(1, count + 1))
    distance, index = KDTree(among).query(places, k=ranks, distance_upper_bound=within)
    return np.asarray(distance), np.asarray(index, np.intp)


UNMATCHED = -1  # Index of the detection of a marker that has none


def pair_nearest(expected_px: Array, found_px: Array, within_px: Array) -> Intp:
    """Match markers with detections that are mutually nearest.

    Parameters
    ----------
    expected_px : (N, 2) float64
        Predicted positions of the markers.
    found_px : (M, 2) float64
        Detections.
    within_px : (N,) float64
        Search radius of each marker; negative for a marker that is not matched.

    Returns
    -------
    (N,) intp
        Index of each marker's detection, or -1.
    """
    result = np.full(len(expected_px), UNMATCHED, np.intp)
    searching = np.flatnonzero(within_px >= 0)
    if not len(found_px) or not searching.size:
        return result
    gate_px = within_px[searching]
    # detections beyond the widest gate, which are not found, belong to no marker
    widest_px = np.nextafter(gate_px.max(), np.inf)
    distance, index = nearest(expected_px[searching], found_px, 1, widest_px)
    distance, index = distance[:, 0], index[:, 0]
    nearest_marker = np.full(len(found_px) + 1, UNMATCHED, np.intp)
    far_first = np.argsort(-distance, kind="stable")
    nearest_marker[index[far_first]] = far_first
    mutual = nearest_marker[index] == np.arange(len(searching))
    good = (distance <= gate_px) & mutual
    result[searching[good]] = index[good]
    return result


class GROWTH:
    """Parameters of matching: of pairs, of their growth, and of the choice among hypotheses."""

    # [count] Fewest matched markers of an explanation. Source: an affine map has three unknowns
    # per axis; one more marker gives a residual.
    min_markers = 4
    # [count] Fewest matched neighbours that predict the position of a marker. Source: three
    # points define a plane.
    min_neighbours = 3
    # [spacings] Search radius around the position that the neighbours predict, and upper bound of
    # the tolerance. A marker whose position is less certain is not searched for.
    gate_spacings = 0.3
    # [spacings] Lower bound of the tolerance, the residual at which a marker is an outlier.
    min_tolerance = 0.1
    # [pitches] Neighbours whose steps differ by more belong to different regions. Source: half of a
    # pitch; beyond it another marker is closer.
    tear_pitches = 0.5
    bins_per_pitch = 6  # [count] Resolution of the histogram of shifts


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """The neighbours of each marker in the reference; they never change while the gel is sheared.

    Attributes
    ----------
    index : (N, K) intp
        The neighbours of each marker, nearest first.
    moments : (N, K, 6) float64
        Weight w of each neighbour, times 1, x, y, x², x y and y² of its offset.
    shares : (N, K) float64
        Coefficient of each neighbour in the plane fit at the marker, with equal trust in all.
    offsets : (N, K, 2) float64
        Position of each neighbour relative to the marker, in pitches.
    pitch_px : float
        Median distance between nearest neighbours.
    spacing_px : (N,) float64
        Distance of each marker's nearest neighbour, at most the pitch.

    References
    ----------
    .. [1] W. S. Cleveland, "Robust locally weighted regression and smoothing scatterplots", Journal
       of the American Statistical Association 74(368), 1979.
    """

    index: NDArray[np.intp]
    moments: Array
    shares: Array
    offsets: Array
    pitch_px: float
    spacing_px: Array

    @classmethod
    def from_places(cls, places_px: Array) -> Neighbourhood:
        """Return the neighbourhood of (N, 2) markers; N is at least 2."""
        count = len(places_px)
        wanted = min(10, count - 1)  # [markers]
        distance, index = nearest(places_px, places_px, wanted + 1)
        distance, index = distance[:, 1:], index[:, 1:]
        pitch = float(np.median(distance[:, 0]))
        # [farthest neighbours] where the weight reaches 0
        reach = 1.3 * distance.max(axis=1, keepdims=True)
        weight = (1 - (distance / reach) ** 2) ** 2
        x, y = np.moveaxis((places_px[index] - places_px[:, None]) / reach[..., None], -1, 0)
        ridge = 0.05  # [squared kernel reaches] for slopes where all neighbours are on one side
        powers = [np.ones_like(x), x, y, x * x + ridge, x * y, y * y + ridge]
        moments = np.stack([weight * power for power in powers], axis=-1)
        return cls(
            index,
            moments,
            _shares(moments, np.ones(index.shape)),
            (places_px[index] - places_px[:, None]) / pitch,
            pitch,
            np.minimum(distance[:, 0], pitch),
        )

    def fit(self, values: Array, trust: Array) -> Array:
        """Predict the value of each marker from its neighbours, by a weighted plane fit.

        Parameters
        ----------
        values : (N, 2) float64
        trust : (N,) float64
            Weight of each marker as a neighbour; 0 leaves it out.

        Returns
        -------
        (N, 2) float64
            0 where no neighbour has a weight.
        """
        if trust.all() and trust.min() == trust.max():
            share = self.shares
        else:
            share = _shares(self.moments, trust.take(self.index))
        return np.asarray(np.einsum("nk,nkc->nc", share, values.take(self.index, axis=0)))

    def nearby(self, distance: Array, known: Bool) -> Array:
        """Mean (N,) over the known neighbours of each marker; 0 without any."""
        counted = known[self.index]
        total = (distance[self.index] * counted).sum(axis=1)
        return np.asarray(total / np.maximum(counted.sum(axis=1), 1))

    def extrapolation(self, known: Bool) -> Array:
        """Factor (N,) by which a prediction gets worse if the known neighbours are on one side.

        1 for a marker that is surrounded; then it grows as the square of the distance to the mean
        position of the known neighbours.
        """
        counted = known[self.index].astype(np.float64)
        middle = (counted[:, None] @ self.offsets)[:, 0]
        distance = np.hypot(middle[:, 0], middle[:, 1]) / np.maximum(counted.sum(axis=1), 1)
        # [pitches] a marker whose neighbours' mean position is farther is not surrounded by them
        return np.asarray(np.maximum(distance / 1.1, 1) ** 2)

    def supporters(self, known: Bool) -> NDArray[np.intp]:
        """Number (N,) of known neighbours of each marker."""
        return np.asarray(known[self.index].sum(axis=1))

    def measure_unevenness(self, step_px: Array) -> Array:
        """Difference (N, K) of the step of each marker from those of its neighbours, pitches."""
        x, y = (along[self.index] - along[:, None] for along in step_px.T)
        return np.asarray(np.hypot(x, y) / self.pitch_px)

    def find_regions(self, step_px: Array, known: Bool) -> NDArray[np.int32]:
        """Label the regions (N,) of known markers whose steps are like those of neighbours."""
        from scipy.sparse import csr_matrix
        from scipy.sparse.csgraph import connected_components

        alike = self.measure_unevenness(step_px) < GROWTH.tear_pitches
        one, rank = (alike & known[self.index] & known[:, None]).nonzero()
        count = len(known)
        bonds = csr_matrix((np.ones(len(one)), (one, self.index[one, rank])), (count, count))
        return np.asarray(connected_components(bonds, directed=False)[1])


def _shares(moments: Array, trusted: Array) -> Array:
    """Coefficients of the neighbours (N, K) in the plane fit at a marker, by Cramer's rule."""
    one, x, y, xx, xy, yy = (trusted[:, None] @ moments)[:, 0].T
    minors = np.stack([xx * yy - xy * xy, xy * y - x * yy, x * xy - xx * y], axis=-1)
    determinant = one * minors[:, 0] + x * minors[:, 1] + y * minors[:, 2]
    minors /= np.maximum(determinant, 1e-12)[:, None]
    return np.asarray(trusted * (moments[:, :, :3] @ minors[:, :, None])[..., 0])


# [count] With fewer markers, none of them near the border, no contact is reported
_MIN_MARKERS = 25
_CLIP_SIGMAS = 4.0  # [noise sigmas] Residuals are clipped at this many


def shows_contact(places_px: NDArray[Any]) -> bool:
    """Return whether the spacing of the markers varies as a contact stretches it.

    A print is irregular from marker to marker, and a lens or a dome changes the spacing slowly
    over the whole view. A contact acts between these scales: it correlates spacings that are two
    pitches apart. A light press is not detected, so False does not guarantee an undeformed surface.

    Parameters
    ----------
    places_px : (N, 2) float
        Positions of the markers, x and y.
    """
    places_px = np.asarray(places_px, np.float64)
    if len(places_px) < _MIN_MARKERS:
        return False
    distance, _ = nearest(places_px, places_px, 5)  # [points] the marker itself and four
    pitch = float(np.median(distance[:, 1]))
    border_px = 0.7 * pitch  # markers at the border lack neighbours: less than a row
    low, high = places_px.min(axis=0) + border_px, places_px.max(axis=0) - border_px
    inner = np.asarray(((places_px > low) & (places_px < high)).all(axis=1))
    if inner.sum() < _MIN_MARKERS:
        return False
    spacing = _without_trend(places_px, distance[:, 1:].mean(axis=1) / pitch, inner)
    pairs = _pairs(places_px, 2.3 * pitch)  # [pitches] pairs two pitches apart
    apart = np.hypot(*(places_px[pairs[:, 0]] - places_px[pairs[:, 1]]).T)
    far_enough = apart > 1.6 * pitch  # [pitches] they share no spacing
    one, other = pairs[far_enough & inner[pairs].all(axis=1)].T
    if not len(one):
        return False
    # [pitches] Standard deviation of what such pairs share, above which a contact stretches the
    # lattice
    return bool(np.mean(spacing[one] * spacing[other]) > 0.006**2)


def _pairs(places_px: NDArray[Any], within_px: float) -> NDArray[np.intp]:
    """Indices (E, 2) of the pairs of points at most this far apart, the lower index first."""
    from scipy.spatial import KDTree

    pairs = KDTree(places_px).query_pairs(within_px, output_type="ndarray")
    return np.asarray(pairs, np.intp)


def _without_trend(places_px: NDArray[Any], spacing: NDArray[Any], inner: NDArray[Any]) -> Any:
    """Residual of a robust quadratic fit to the spacing over the view, with outliers clipped."""
    powers = terms((places_px - places_px.mean(axis=0)) / np.ptp(places_px, axis=0), 2)
    weight = inner.astype(np.float64)
    for _ in range(4):  # [rounds] of the robust trend
        factors = np.linalg.lstsq(powers * weight[:, None], spacing * weight, rcond=None)[0]
        residual = spacing - powers @ factors
        scale = sigma_of(residual[inner]) + 1e-3  # [pitches] for a perfect lattice
        weight = inner / (1 + (residual / (2.0 * scale)) ** 2)  # [noise sigmas] half the weight
    return np.clip(residual, -_CLIP_SIGMAS * scale, _CLIP_SIGMAS * scale)
