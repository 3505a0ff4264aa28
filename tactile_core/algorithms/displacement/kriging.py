"""The likeliest smooth field through values at scattered markers, with weights that are kept."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64

NOISE_VARIANCE = 3e-4
"""Of a marker, over the variance of the field: 0.1 px of 28 µm beside 0.16 mm."""

_SHIFT_VARIANCE, _SLOPE_VARIANCE = 1e2, 1e1
"""A shift or a slope of the whole field is not held back."""


class Kriging:
    """Interpolation of values at markers by a Matérn covariance (ν = 3/2) and a plane.

    The weights depend on where the markers are, not on their values nor on which of them are seen:
    a marker that is not seen takes the value that the others make likeliest, and the result is
    exactly what the others alone give.

    Parameters
    ----------
    markers_mm : (N, 2) float
        Where the markers are.
    points_mm : (M, 2) float
        Where the field is wanted.
    range_mm : float
        Distance over which the field changes.
    """

    def __init__(self, markers_mm: Array, points_mm: Array, *, range_mm: float) -> None:
        markers, points = (np.array(at, np.float64) / range_mm for at in (markers_mm, points_mm))
        middle = points.mean(axis=0)
        markers, points = markers - middle, points - middle
        between: Float64 = _covariance(markers, markers) + NOISE_VARIANCE * np.eye(len(markers))
        self._precision = np.asarray(np.linalg.inv(between), np.float64)
        self._weights: Float32 = (_covariance(points, markers) @ self._precision).astype(np.float32)

    def completed(self, values: Float64, seen: Bool) -> Float64:
        """Replace the values of unseen markers by what the others make likeliest.

        Parameters
        ----------
        values : (N, J) float64
            J fields.
        seen : (N,) bool

        Returns
        -------
        (N, J) float64
        """
        if seen.all():
            return values
        unseen = np.flatnonzero(~seen)
        completed = np.where(seen[:, None], values, 0.0)
        rows = self._precision[unseen]
        completed[unseen] = -np.linalg.solve(rows[:, unseen], rows @ completed)
        return completed

    def weighed(self, values: Float64) -> Float64:
        """(N, J) inverse covariance times completed values."""
        return np.asarray(self._precision @ values)

    def field(self, values: Float64) -> Float32:
        """(M, J) of completed values (N, J)."""
        return np.asarray(self._weights @ values.astype(np.float32))


def _covariance(a: Float64, b: Float64) -> Float64:
    from scipy.spatial.distance import cdist

    far = np.sqrt(3) * cdist(a, b)
    return np.asarray(
        (1 + far) * np.exp(-far) + _SHIFT_VARIANCE + _SLOPE_VARIANCE * (a @ b.T), np.float64
    )
