"""Printed markers in one frame: the centroids of connected dark spots."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32, Float64, UInt8
from tactile_core.algorithms.markers.contrast import FULL
from tactile_core.algorithms.markers.spots import Spots, measured_spots

# Lengths in diameters of a marker: smoothing, what is opened, the neighbourhood of a peak, the rim.
_SMOOTH, _OPEN, _AROUND, _RIM = 1 / 3, 0.4, 2.2, 0.28
# Shares of a peak: what belongs to a marker, and what its rim is weighed from.
_OWN_SHARE, _BACKGROUND_SHARE = 0.6, 0.15
# Shares of the usual darkness: what may belong to a marker, and the faintest marker; the latter
# also as a share of nearly the faintest marker of the print.
_LEVEL_SHARE, _FAINTEST, _FAINTER = 0.3, 0.28, 0.45
# In markers of usual ink. A marker that is faint and small is dirt (ink times darkness).
_SPECK, _LEAST_INK, _MOST_INK, _LEAST_IN_VIEW, _LEAST_FAINT_INK = 0.2, 0.33, 9.0, 0.12, 0.11
# Longest over widest spread; ink over that of an even ellipse as dark as the peak.
_LONGEST, _SPARSEST = 2.4, 0.57
# Longest spread of what a border leaves of a marker, in half sizes.
_SLIVER = 0.7
# Two pieces of one marker: ink of each and of both, and how many half sizes they are apart.
_PIECE_INK, _PIECES_INK, _PIECES_APART = (0.12, 0.75), (0.5, 1.35), 1.5
# Several markers in one: ink, half sizes of spread across, darkness, and how even the pitch is.
_BAR_INK, _BAR_WIDTH, _BAR_PEAK, _PITCH_TOLERANCE = 1.6, 0.8, 0.75, 0.4
# Half the side of a square, and half the diameter of a disc, in standard deviations: about.
_HALF_SIZE = 1.85
_SAMPLE_PX = 6
_SQUARES = np.arange(FULL + 1) ** 2


def find_markers(
    contrast: UInt8,
    shape: tuple[int, ...],
    *,
    diameter_px: float,
    pitch_px: float,
    least: float = 0.08,
    compiled: bool = False,
) -> tuple[Float32, Bool]:
    """Find the printed markers of one frame, of any compact shape.

    The way of the 2015 paper: background, difference, threshold, connected components, centroids.
    The threshold follows each marker: what is 0.6 times as dark as the darkest pixel of its
    neighbourhood belongs to it, so that faint and strong markers, blurred and sharp ones are cut at
    the same height of their flanks. Ridges and grain of the object are thinner or fainter than
    markers, specks of dirt smaller. The print itself tells what is usual: markers of a third to
    nine times the median ink pass. Two pieces that a highlight has left of a marker are one;
    markers that have run into their neighbours, a bar of a pitch or two, are taken apart.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`tactile_core.algorithms.markers.contrast_of`.
    shape : (H, W)
        Of the image.
    diameter_px, pitch_px : float
        Size of a marker, and distance of neighbours, in the image.
    least : float
        Share of light that markers take away, at least.
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.

    Returns
    -------
    centres_px : (N, 2) float32
        x and y.
    cut : (N,) bool
        The border cuts the marker. Where its centre is, perhaps just out of view, is told from its
        part in view and the size of the others.
    """
    scale = shape[1] / contrast.shape[1], shape[0] / contrast.shape[0]
    size = diameter_px / scale[0]
    smooth = np.asarray(cv2.GaussianBlur(contrast, (_odd(_SMOOTH * size),) * 2, 0), np.uint8)
    thick = cv2.morphologyEx(smooth, cv2.MORPH_OPEN, _square(_OPEN * size))
    peaks = np.asarray(cv2.dilate(thick, _square(_AROUND * size)), np.uint8)
    level = max(_usual(peaks), least * FULL)
    own = cv2.compare(thick, cv2.convertScaleAbs(peaks, alpha=_OWN_SHARE), cv2.CMP_GT)
    _, usual = cv2.threshold(thick, _LEVEL_SHARE * level, FULL, cv2.THRESH_BINARY)
    dark = np.asarray(cv2.bitwise_and(own, usual), np.uint8)
    background = cv2.convertScaleAbs(peaks, alpha=_BACKGROUND_SHARE)
    weight = np.asarray(cv2.subtract(smooth, background), np.uint8)
    faintest, rim = max(_FAINTEST * level, least * FULL), max(1, round(_RIM * size))
    spots = measured_spots(dark, weight, peaks, faintest=faintest, rim=rim, compiled=compiled)
    centres, cut = _markers(spots, pitch_px / scale[0], contrast.shape)
    to_image = (centres + 0.5) * np.array(scale) - 0.5
    return to_image.astype(np.float32), cut


def _markers(spots: Spots, pitch: float, shape: tuple[int, ...]) -> tuple[Float64, Bool]:
    """Centres (N, 2) of the spots that are markers, and whether the border cuts them."""
    cut = spots.cut.any(1)
    long, wide = spots.spread.T
    compact = long < _LONGEST * wide
    whole = compact & ~cut
    if not whole.any():
        return np.zeros((0, 2)), np.zeros(0, np.bool_)
    usual = whole & (spots.ink > _SPECK * _heavy(spots.ink[whole]))
    ink = spots.ink / _middle(spots.ink[usual])
    area = long * wide
    filled = spots.ink > _SPARSEST * 4 * np.pi * area * spots.peak
    peak = spots.peak / _middle(spots.peak[usual])
    marker = (
        whole & filled & (ink > _LEAST_INK) & (ink < _MOST_INK) & (ink * peak > _LEAST_FAINT_INK)
    )
    if marker.any():
        # an even print has no faint markers: what looks like one is shading
        marker &= peak > _FAINTER * _lowest(peak[marker], 0.05)
    half_size = _HALF_SIZE * float(np.sqrt(_middle(area[usual])))
    piece = np.flatnonzero(~cut & filled & (ink > _PIECE_INK[0]) & (ink < _PIECE_INK[1]))
    centres = list[Float64]()
    if piece.size > 1:
        centres, united = _united(spots.chosen(piece), ink[piece], _PIECES_APART * half_size)
        marker[piece[united]] = False
    centres.append(spots.centres[marker])
    bar = ~cut & ~marker & filled & (ink > _BAR_INK) & (wide < _BAR_WIDTH * half_size)
    if bar.any():
        bar &= peak > _BAR_PEAK
        centres += _taken_apart(spots.chosen(bar), ink[bar], pitch, half_size)
    # the sliver of a marker is long, but no longer than a marker
    cut &= (ink > _LEAST_IN_VIEW) & (compact | (long < _SLIVER * half_size))
    inside = sum(map(len, centres))
    if cut.any():
        centres.append(_completed(spots.chosen(cut), half_size, shape))
    found = np.concatenate(centres)
    return found, np.arange(len(found)) >= inside


def _united(spots: Spots, ink: Float64, near: float) -> tuple[list[Float64], NDArray[np.intp]]:
    """Centres (1, 2) of markers that a highlight has split in two, and which spots these are.

    Each piece belongs to one marker, the nearest two first.
    """
    apart = np.linalg.norm(spots.centres[:, None] - spots.centres, axis=2)
    total = ink[:, None] + ink
    fit = (apart < near) & (total > _PIECES_INK[0]) & (total < _PIECES_INK[1])
    pairs = np.argwhere(np.triu(fit, 1))
    centres, used = [], list[int]()
    for pair in pairs[np.argsort(apart[pairs[:, 0], pairs[:, 1]])]:
        if not set(used) & set(pair.tolist()):
            used += pair.tolist()
            centres.append(np.average(spots.centres[pair], axis=0, weights=ink[pair])[None])
    return centres, np.array(used, np.intp)


def _completed(spots: Spots, half_size: float, shape: tuple[int, ...]) -> Float64:
    """Centres of markers that the border cuts; they may lie beyond it.

    The part in view is as deep as twice the distance of its centroid from the border.
    """
    last = np.array(shape[::-1]) - 1.0
    low, high = spots.cut[:, :2], spots.cut[:, 2:]
    from_low = 2 * (spots.centres + 0.5) - 0.5 - half_size
    from_high = last - (2 * (last - spots.centres + 0.5) - 0.5 - half_size)
    centres = np.where(low, np.minimum(from_low, spots.centres), spots.centres)
    centres = np.where(high, np.maximum(from_high, spots.centres), centres)
    return np.asarray(centres)


def _taken_apart(spots: Spots, ink: Float64, pitch: float, half_size: float) -> list[Float64]:
    """Centres of the markers that make up each bar, about a pitch apart along it.

    A bar that is inked evenly has the variance of a uniform distribution. Of two markers, each
    holds a marker's ink, and only what else there is lies evenly between them.
    """
    long, wide = spots.spread.T
    reach = np.sqrt(3) * (long - wide)
    count = 1 + np.rint(2 * reach / pitch).astype(int)
    markers = np.minimum(2 / ink, 1)
    bridge = (1 - markers) / 3
    a, b, variance = markers + bridge, bridge * half_size, long**2 - wide**2
    of_two = (b + np.sqrt(b * b + a * np.maximum(variance - b * half_size, 0))) / a
    reach = np.where(count == 2, of_two, reach)
    apart = 2 * reach / np.maximum(count - 1, 1)
    bars = zip(spots.centres, spots.axes, reach, count, strict=True)
    usual = (count > 1) & (abs(apart / pitch - 1) < _PITCH_TOLERANCE)
    return [
        centre + np.linspace(-half, half, number)[:, None] * axis
        for (centre, axis, half, number), keep in zip(bars, usual, strict=True)
        if keep
    ]


def _usual(peaks: UInt8) -> float:
    """How dark markers usually are.

    Much of the image lies beside a marker and shows its peak; the darker, the more it counts, so
    that grain between markers that lie far apart does not.
    """
    counts = np.bincount(peaks[::_SAMPLE_PX, ::_SAMPLE_PX].ravel(), minlength=FULL + 1)
    weight = np.cumsum(counts * _SQUARES)
    return float(weight.searchsorted(weight[-1] / 2))


def _heavy(ink: Float64) -> float:
    """Ink of the spot that holds the middle of all ink: a marker, however many specks there are."""
    ordered = np.sort(ink)
    total = np.cumsum(ordered)
    return float(ordered[total.searchsorted(total[-1] / 2)])


def _middle(values: NDArray[Any]) -> float:
    return _lowest(values, 0.5)


def _lowest(values: NDArray[Any], share: float) -> float:
    """The value below which this share of them lies."""
    rank = int(share * len(values))
    return float(np.partition(values, rank)[rank])


def _odd(length: float) -> int:
    return 2 * int(length) + 1 if length >= 1 else 1


def _square(length: float) -> UInt8:
    side = 2 * int(length / 2) + 1
    return np.ones((side, side), np.uint8)
