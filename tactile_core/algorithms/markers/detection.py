"""Detects markers, and separates their kinds."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32, Float64, UInt8
from tactile_core.algorithms.markers.contrast import DETECTION, FULL
from tactile_core.algorithms.markers.spots import Spots, measured_spots, spot_pixels


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


def find_markers(
    contrast: UInt8,
    shape: tuple[int, ...],
    *,
    diameter_px: float,
    pitch_px: float,
    min_contrast: float = DETECTION.min_marker_contrast,
) -> tuple[Float32, Bool]:
    """Detect the printed markers of one frame, of any compact shape.

    The steps are those of [1]_: background, difference, threshold, connected components,
    centroids. Three of them differ:

    - The threshold is local: pixels belong to a marker whose contrast exceeds 0.6 of the peak
      contrast in their neighbourhood. So faint, strong, blurred and sharp markers are all
      thresholded at the same relative height. An opening removes texture of the object, which is
      thinner than markers.
    - Spots are selected relative to the typical marker of the frame: from a third to nine times
      the median integrated contrast.
    - Two pieces of a marker that a highlight splits are merged, and bars of markers that have
      merged are split at the pitch.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`tactile_core.algorithms.markers.contrast_of`.
    shape : (H, W)
        Shape of the image.
    diameter_px, pitch_px : float
        Diameter of a marker and distance between neighbours, in pixels of the image.
    min_contrast : float
        Minimum share of the light that a marker absorbs.

    Returns
    -------
    centres_px : (N, 2) float32
        x and y.
    truncated : (N,) bool
        Whether the image border truncates the marker. The centre of such a marker is extrapolated
        from the part in view and the typical size, and may be outside the image.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """
    scale = shape[1] / contrast.shape[1], shape[0] / contrast.shape[0]
    size = diameter_px / scale[0]
    darkest = min_contrast * FULL
    dark, weight, peaks, level = spot_pixels(contrast, size, darkest=darkest)
    faintest = max(DETECTION.faintest_peak * level, darkest)
    rim = max(1, round(DETECTION.rim_diameters * size))
    spots = measured_spots(dark, weight, peaks, faintest=faintest, rim=rim)
    centres, truncated = _markers(spots, pitch_px / scale[0], contrast.shape)
    to_image = (centres + 0.5) * np.array(scale) - 0.5
    return to_image.astype(np.float32), truncated


def _markers(spots: Spots, pitch: float, shape: tuple[int, ...]) -> tuple[Float64, Bool]:
    """Centres (N, 2) of the spots that are markers, and whether the border truncates them."""
    kinds = kinds_of(spots)
    marker, mass, half_size = kinds.marker, kinds.mass, kinds.half_size
    centres = list[Float64]()
    if np.count_nonzero(kinds.piece) > 1:
        piece = np.flatnonzero(kinds.piece)
        nearby = DETECTION.piece_distance * half_size
        centres, merged = _merge_pieces(spots.subset(piece), mass[piece], nearby)
        marker[piece[merged]] = False
    centres.append(spots.centres[marker])
    if np.count_nonzero(kinds.bar):
        centres += _split_bars(spots.subset(kinds.bar), mass[kinds.bar], pitch, half_size)
    inside = sum(map(len, centres))
    if np.count_nonzero(kinds.truncated):
        centres.append(_extrapolate_centres(spots.subset(kinds.truncated), half_size, shape))
    found = np.concatenate(centres)
    return found, np.arange(len(found)) >= inside


def _merge_pieces(
    spots: Spots, mass: Float64, nearby: float
) -> tuple[list[Float64], NDArray[np.intp]]:
    """Centres (1, 2) of markers that a highlight has split in two, and the indices of the pieces.

    Each piece belongs to one marker; the closest pairs are merged first.
    """
    distance = np.linalg.norm(spots.centres[:, None] - spots.centres, axis=2)
    total = mass[:, None] + mass
    smallest, largest = DETECTION.pieces_mass
    fit = (distance < nearby) & (total > smallest) & (total < largest)
    pairs = np.argwhere(np.triu(fit, 1))
    centres, used = [], list[int]()
    for pair in pairs[np.argsort(distance[pairs[:, 0], pairs[:, 1]])]:
        if not set(used) & set(pair.tolist()):
            used += pair.tolist()
            centres.append(np.average(spots.centres[pair], axis=0, weights=mass[pair])[None])
    return centres, np.array(used, np.intp)


def _extrapolate_centres(spots: Spots, half_size: float, shape: tuple[int, ...]) -> Float64:
    """Centres of markers that the border truncates; they may be outside the image.

    The part in view is twice as deep as the distance of its centroid from the border.
    """
    last = np.array(shape[::-1]) - 1.0
    low, high = spots.truncated[:, :2], spots.truncated[:, 2:]
    from_low = 2 * (spots.centres + 0.5) - 0.5 - half_size
    from_high = last - (2 * (last - spots.centres + 0.5) - 0.5 - half_size)
    centres = np.where(low, np.minimum(from_low, spots.centres), spots.centres)
    centres = np.where(high, np.maximum(from_high, spots.centres), centres)
    return np.asarray(centres)


def _split_bars(spots: Spots, mass: Float64, pitch: float, half_size: float) -> list[Float64]:
    """Centres of the markers that form each bar, about a pitch apart along its major axis.

    A uniform bar has the variance of a uniform distribution. A bar of two markers has the mass of
    one marker at either end; the rest is spread uniformly between them.
    """
    major, minor = spots.sigma_px.T
    half_length = np.sqrt(3) * (major - minor)
    count = 1 + np.rint(2 * half_length / pitch).astype(int)
    markers = np.minimum(2 / mass, 1)
    bridge = (1 - markers) / 3
    a, b, variance = markers + bridge, bridge * half_size, major**2 - minor**2
    of_two = (b + np.sqrt(b * b + a * np.maximum(variance - b * half_size, 0))) / a
    half_length = np.where(count == 2, of_two, half_length)
    spacing = 2 * half_length / np.maximum(count - 1, 1)
    bars = zip(spots.centres, spots.major_axes, half_length, count, strict=True)
    regular = (count > 1) & (abs(spacing / pitch - 1) < DETECTION.bar_pitch_tolerance)
    return [
        centre + np.linspace(-half, half, number)[:, None] * axis
        for (centre, axis, half, number), keep in zip(bars, regular, strict=True)
        if keep
    ]
