"""Test whether a reference image already shows a contact, from the spacing of its markers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import sigma_of, terms
from tactile_core.algorithms.marker_tracking.pairing import nearest


class STRETCH:
    """Parameters of the test for a stretched lattice. They are relative to the pitch."""

    # [count] With fewer markers, none of them near the border, no contact is reported.
    min_markers = 25
    # [count] Nearest points whose mean distance is the local spacing, the marker itself included.
    # Source: the four nearest neighbours in a square lattice.
    neighbours = 5
    # [pitches] Markers closer to the border lack neighbours and are left out. Source: by hand,
    # less than one row.
    border_pitches = 0.7
    # [pitches] Range of distances of the pairs whose spacings are compared. Source: by hand,
    # around two pitches, where markers share no neighbour spacing.
    nearest_pair_pitches = 1.6
    farthest_pair_pitches = 2.3
    # [pitches] Standard deviation of the part of the spacing that such pairs share, above which a
    # contact stretches the lattice.
    correlated_spacing = 0.006
    rounds = 4  # [count] Rounds of the robust trend
    # [noise sigmas] Residual at which a marker has half its weight in the trend.
    outlier_sigmas = 2.0
    clip_sigmas = 4.0  # [noise sigmas] Residuals are clipped at this many
    min_sigma = 1e-3  # [pitches] Added to the noise sigma, for a perfect lattice


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
    if len(places_px) < STRETCH.min_markers:
        return False
    distance, _ = nearest(places_px, places_px, STRETCH.neighbours)
    pitch = float(np.median(distance[:, 1]))
    border_px = STRETCH.border_pitches * pitch
    low, high = places_px.min(axis=0) + border_px, places_px.max(axis=0) - border_px
    inner = np.asarray(((places_px > low) & (places_px < high)).all(axis=1))
    if inner.sum() < STRETCH.min_markers:
        return False
    spacing = _without_trend(places_px, distance[:, 1:].mean(axis=1) / pitch, inner)
    pairs = _pairs(places_px, STRETCH.farthest_pair_pitches * pitch)
    apart = np.hypot(*(places_px[pairs[:, 0]] - places_px[pairs[:, 1]]).T)
    far_enough = apart > STRETCH.nearest_pair_pitches * pitch
    one, other = pairs[far_enough & inner[pairs].all(axis=1)].T
    if not len(one):
        return False
    return bool(np.mean(spacing[one] * spacing[other]) > STRETCH.correlated_spacing**2)


def _pairs(places_px: NDArray[Any], within_px: float) -> NDArray[np.intp]:
    """Indices (E, 2) of the pairs of points at most this far apart, the lower index first."""
    from scipy.spatial import KDTree

    pairs = KDTree(places_px).query_pairs(within_px, output_type="ndarray")
    return np.asarray(pairs, np.intp)


def _without_trend(places_px: NDArray[Any], spacing: NDArray[Any], inner: NDArray[Any]) -> Any:
    """Residual of a robust quadratic fit to the spacing over the view, with outliers clipped."""
    powers = terms((places_px - places_px.mean(axis=0)) / np.ptp(places_px, axis=0), 2)
    weight = inner.astype(np.float64)
    for _ in range(STRETCH.rounds):
        factors = np.linalg.lstsq(powers * weight[:, None], spacing * weight, rcond=None)[0]
        residual = spacing - powers @ factors
        scale = sigma_of(residual[inner]) + STRETCH.min_sigma
        weight = inner / (1 + (residual / (STRETCH.outlier_sigmas * scale)) ** 2)
    return np.clip(residual, -STRETCH.clip_sigmas * scale, STRETCH.clip_sigmas * scale)
