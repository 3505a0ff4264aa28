"""Whether markers that should be at rest are stretched apart."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.quantile import sigma_of
from tactile_core.algorithms.arrays.regression import terms
from tactile_core.algorithms.marker_tracking.nearest import nearest

_FEWEST = 25
_UNEVEN = 0.006
_NEIGHBOURS = 5
_BORDER = 0.7
_NEAR, _FAR = 1.6, 2.3


def shows_contact(places_px: NDArray[Any]) -> bool:
    """Say whether the spacing of markers varies as a contact stretches it.

    A print is irregular from marker to marker, and a lens or a dome widens the spacing slowly over
    the whole view. A contact acts between these scales: spacings two pitches apart are alike. A
    light press does not show, so that False does not guarantee an undeformed surface.

    Parameters
    ----------
    places_px : (N, 2) float
    """
    from scipy.spatial import KDTree

    places_px = np.asarray(places_px, np.float64)
    if len(places_px) < _FEWEST:
        return False
    tree = KDTree(places_px)
    distance, _ = nearest(places_px, places_px, _NEIGHBOURS)
    pitch = float(np.median(distance[:, 1]))
    low, high = places_px.min(axis=0) + _BORDER * pitch, places_px.max(axis=0) - _BORDER * pitch
    inner = np.asarray(((places_px > low) & (places_px < high)).all(axis=1))
    if inner.sum() < _FEWEST:
        return False
    spacing = _without_trend(places_px, distance[:, 1:].mean(axis=1) / pitch, inner)
    pairs = tree.query_pairs(_FAR * pitch, output_type="ndarray")
    apart = np.hypot(*(places_px[pairs[:, 0]] - places_px[pairs[:, 1]]).T)
    one, other = pairs[(apart > _NEAR * pitch) & inner[pairs].all(axis=1)].T
    return bool(np.mean(spacing[one] * spacing[other]) > _UNEVEN**2) if len(one) else False


def _without_trend(places_px: NDArray[Any], spacing: NDArray[Any], inner: NDArray[Any]) -> Any:
    """What a robust quadratic over the view leaves of the spacing, outliers clipped."""
    powers = terms((places_px - places_px.mean(axis=0)) / np.ptp(places_px, axis=0), 2)
    weight = inner.astype(np.float64)
    for _ in range(4):
        factors = np.linalg.lstsq(powers * weight[:, None], spacing * weight, rcond=None)[0]
        rest = spacing - powers @ factors
        scale = sigma_of(rest[inner]) + 1e-3
        weight = inner / (1 + (rest / (2 * scale)) ** 2)
    return np.clip(rest, -4 * scale, 4 * scale)
