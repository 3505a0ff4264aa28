"""Kernel of :mod:`tactile_core.algorithms.markers.kinds`: which spots are markers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Bool, Float64, UInt8
from tactile_core.algorithms.kernels.options import LOOP, PART
from tactile_core.algorithms.kernels.selection import sort


@njit(**PART)
def _quantile(values: Float64, chosen: Bool, share: float) -> float:
    some = values[chosen]
    sort(some)
    return float(some[int(share * len(some))])


@njit(**PART)
def _weighted_median(values: Float64, chosen: Bool) -> float:
    some = values[chosen]
    sort(some)
    half, total = some.sum() / 2, 0.0
    for value in some:
        total += value
        if total >= half:
            return float(value)
    return float(some[-1])


@njit(**LOOP)
def kinds_of(
    mass: Float64, sigma: Float64, peak: UInt8, truncated: Bool, limits: Any
) -> tuple[Any, Any, float]:
    """Judge spots relative to the typical spot of the frame.

    Parameters
    ----------
    mass : (N,) float64
    sigma : (N, 2) float64
    peak : (N,) uint8
    truncated : (N, 4) bool
        Fields of :class:`tactile_core.algorithms.markers.spots.Spots`.
    limits : tuple of 16 float
        Parameters of detection, in the order in which they are unpacked.

    Returns
    -------
    kinds : (4, N) bool
        Markers, pieces, bars, and truncated markers.
    mass : (N,) float64
        In typical markers.
    half_size : float
        Of a marker, px; 0 if no spot is whole.
    """
    (
        max_elongation,
        min_fill,
        speck_mass,
        half_size_sigmas,
        min_mass,
        max_mass,
        min_mass_times_peak,
        faint_percentile,
        faintest_peak_of_print,
        smallest_piece,
        largest_piece,
        bar_mass,
        bar_sigma,
        bar_peak,
        max_truncated_sigma,
        min_truncated_mass,
    ) = limits
    count = len(mass)
    kinds = np.zeros((4, count), np.bool_)
    marker, piece, bar, at_border = kinds[0], kinds[1], kinds[2], kinds[3]
    whole, filled = np.zeros(count, np.bool_), np.empty(count, np.bool_)
    area, bright, relative = np.empty(count), np.empty(count), np.empty(count)
    for n in range(count):
        area[n], bright[n] = sigma[n, 0] * sigma[n, 1], peak[n]
        for side in range(4):
            at_border[n] |= truncated[n, side]
        whole[n] = sigma[n, 0] < max_elongation * sigma[n, 1] and not at_border[n]
        filled[n] = mass[n] > min_fill * 4 * np.pi * area[n] * bright[n]
    if not whole.any():
        at_border[:] = False
        return kinds, relative, 0.0
    speck = speck_mass * _weighted_median(mass, whole)
    typical = whole & (mass > speck)
    per_mass, per_peak = _quantile(mass, typical, 0.5), _quantile(bright, typical, 0.5)
    half_size = half_size_sigmas * np.sqrt(_quantile(area, typical, 0.5))
    for n in range(count):
        relative[n] = mass[n] / per_mass
        bright[n] /= per_peak
        marker[n] = (
            whole[n]
            and filled[n]
            and min_mass < relative[n] < max_mass
            and relative[n] * bright[n] > min_mass_times_peak
        )
    if marker.any():
        faint = _quantile(bright, marker, faint_percentile)
        for n in range(count):
            marker[n] &= bright[n] > faintest_peak_of_print * faint
    for n in range(count):
        solid = filled[n] and not at_border[n]
        piece[n] = solid and smallest_piece < relative[n] < largest_piece
        bar[n] = (
            solid
            and not marker[n]
            and relative[n] > bar_mass
            and sigma[n, 1] < bar_sigma * half_size
            and bright[n] > bar_peak
        )
        short = sigma[n, 0] < max_truncated_sigma * half_size
        compact = sigma[n, 0] < max_elongation * sigma[n, 1]
        at_border[n] &= relative[n] > min_truncated_mass and (compact or short)
    return kinds, relative, half_size
