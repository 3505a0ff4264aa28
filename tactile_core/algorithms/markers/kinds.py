"""Which spots are markers, pieces of markers, or several markers, relative to the typical one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float64
from tactile_core.algorithms.markers.parameters import DETECTION
from tactile_core.algorithms.markers.spots import Spots


class Kinds(NamedTuple):
    """What each of N spots may be, relative to the typical spot of the frame.

    Attributes
    ----------
    marker : (N,) bool
        Whole markers.
    piece : (N,) bool
        Spots that may be a piece of a marker that a highlight splits; some are also ``marker``.
    bar : (N,) bool
        Bars of markers that have merged.
    truncated : (N,) bool
        Markers that the image border truncates.
    mass : (N,) float64
        Integrated contrast, in typical markers.
    half_size : float
        Half the size of a marker, px; 0 if no spot is whole.
    """

    marker: Bool
    piece: Bool
    bar: Bool
    truncated: Bool
    mass: Float64
    half_size: float


def kinds_of(spots: Spots) -> Kinds:
    """Judge the spots of a frame.

    Parameters
    ----------
    spots : Spots

    Returns
    -------
    Kinds
    """
    truncated = spots.truncated.any(1)
    major, minor = spots.sigma_px.T
    compact = major < DETECTION.max_elongation * minor
    whole = compact & ~truncated
    if not whole.any():
        nothing = np.zeros_like(whole)
        return Kinds(nothing, nothing, nothing, nothing, spots.mass, 0.0)
    speck_mass = DETECTION.speck_mass * _weighted_median(spots.mass[whole])
    typical = whole & (spots.mass > speck_mass)
    mass = spots.mass / _median(spots.mass[typical])
    area = major * minor
    filled = spots.mass > DETECTION.min_fill * 4 * np.pi * area * spots.peak
    peak = spots.peak / _median(spots.peak[typical])
    marker = whole & filled & (mass > DETECTION.min_mass) & (mass < DETECTION.max_mass)
    marker &= mass * peak > DETECTION.min_mass_times_peak
    if marker.any():
        # an even print has no faint markers: a faint spot in it is shading
        faint = _quantile(peak[marker], DETECTION.faint_percentile)
        marker &= peak > DETECTION.faintest_peak_of_print * faint
    half_size = DETECTION.half_size_sigmas * float(np.sqrt(_median(area[typical])))
    smallest, largest = DETECTION.piece_mass
    solid = ~truncated & filled
    piece = solid & (mass > smallest) & (mass < largest)
    bar = solid & ~marker & (mass > DETECTION.bar_mass)
    if bar.any():
        bar &= (minor < DETECTION.bar_sigma * half_size) & (peak > DETECTION.bar_peak)
    # the visible sliver of a marker is elongated, but no longer than a marker
    short = major < DETECTION.max_truncated_sigma * half_size
    truncated &= (mass > DETECTION.min_truncated_mass) & (compact | short)
    return Kinds(marker, piece, bar, truncated, mass, half_size)


def _weighted_median(mass: Float64) -> float:
    """Median mass, weighted by mass: that of a marker, even among many specks."""
    ordered = mass.copy()
    ordered.sort()
    total = ordered.cumsum()
    return float(ordered[total.searchsorted(total[-1] / 2)])


def _median(values: NDArray[Any]) -> float:
    return _quantile(values, 0.5)


def _quantile(values: NDArray[Any], share: float) -> float:
    """The value that this share of the values does not exceed, without interpolation."""
    rank = int(share * len(values))
    values = values.copy()
    values.partition(rank)
    return float(values[rank])
