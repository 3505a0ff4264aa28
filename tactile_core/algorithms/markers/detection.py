"""Printed marks in one frame: the centroids of connected dark spots."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.markers.darkness import FULL, UInt8
from tactile_core.algorithms.markers.spots import Spots, measured_spots

Bool = NDArray[np.bool_]
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]

_SMOOTH, _OPEN, _AROUND = 1 / 3, 0.4, 2.2
_OWN_SHARE, _LEVEL_SHARE = 0.6, 0.3
_BACKGROUND_SHARE = 0.15
_FAINTEST, _LEAST_INK, _MOST_INK = 0.42, 0.25, 9.0
_LONGEST = 2.6
_SPARSEST = 0.3
_SAMPLE_PX = 6


def find_markers(
    darkness: UInt8,
    shape: tuple[int, ...],
    *,
    diameter_px: float,
    pitch_px: float,
    least: float = 0.08,
) -> tuple[Float32, Bool]:
    """Find the printed marks of one frame, of any compact shape.

    The way of the 2015 paper: background, difference, threshold, connected components, centroids.
    The threshold follows each mark: what is 0.6 times as dark as the darkest pixel of its
    neighbourhood belongs to it, so that faint and strong marks, blurred and sharp ones are cut at
    the same height of their flanks. Ridges and grain of the object are thinner or fainter than
    marks, specks of dirt smaller. The print itself tells what is usual: sizes from a quarter to
    nine times the median pass. Marks that have run into a neighbour, a bar about a pitch long, are
    taken apart.

    Parameters
    ----------
    darkness : (h, w) uint8
        From :func:`tactile_core.algorithms.markers.darkness_of`.
    shape : (H, W)
        Of the image.
    diameter_px, pitch_px : float
        Size of a mark, and distance of neighbours, in the image.
    least : float
        Share of light that marks take away, at least.

    Returns
    -------
    centres_px : (N, 2) float32
        x and y.
    cut : (N,) bool
        The border cuts the mark; where its centre would be is told from its part in view and the
        size of the others. A mark whose centre is out of view is left out.
    """
    scale = shape[1] / darkness.shape[1], shape[0] / darkness.shape[0]
    size = diameter_px / scale[0]
    smooth = np.asarray(cv2.GaussianBlur(darkness, (_odd(_SMOOTH * size),) * 2, 0), np.uint8)
    thick = cv2.morphologyEx(smooth, cv2.MORPH_OPEN, _square(_OPEN * size))
    peaks = np.asarray(cv2.dilate(thick, _square(_AROUND * size)), np.uint8)
    level = max(_usual(peaks), least * FULL)
    bound = cv2.max(cv2.convertScaleAbs(peaks, alpha=_OWN_SHARE), _LEVEL_SHARE * level)
    dark = np.asarray(cv2.compare(thick, bound, cv2.CMP_GT), np.uint8)
    background = cv2.convertScaleAbs(peaks, alpha=_BACKGROUND_SHARE)
    weight = np.asarray(cv2.subtract(smooth, background), np.uint8)
    spots = measured_spots(dark, weight, peaks)
    spots = spots.chosen((spots.peak > _FAINTEST * level) & (spots.peak > least * FULL))
    centres, cut = _marks(spots, pitch_px / scale[0], darkness.shape)
    to_image = (centres + 0.5) * np.array(scale) - 0.5
    return to_image.astype(np.float32), cut


def _marks(spots: Spots, pitch: float, shape: tuple[int, ...]) -> tuple[Float64, Bool]:
    """Centres (N, 2) of the spots that are marks, and whether the border cuts them."""
    cut = spots.cut.any(1)
    compact = spots.spread[:, 0] < _LONGEST * spots.spread[:, 1]
    whole = compact & ~cut
    if not whole.any():
        return np.zeros((0, 2)), np.zeros(0, np.bool_)
    ink = spots.ink / np.median(spots.ink[whole])
    area = spots.spread.prod(1)
    filled = spots.ink > _SPARSEST * 4 * np.pi * area * spots.peak
    alone = whole & filled & (ink > _LEAST_INK) & (ink < _MOST_INK)
    half_size = 1.85 * np.sqrt(np.median(area[whole]))
    at_border = _completed(spots.chosen(cut), half_size, shape)
    joined = _taken_apart(spots.chosen(~cut & ~alone & filled), pitch, half_size)
    centres = np.concatenate([spots.centres[alone], joined, at_border])
    flags = np.zeros(len(centres), np.bool_)
    flags[len(centres) - len(at_border) :] = True
    return centres, flags


def _completed(spots: Spots, half_size: float, shape: tuple[int, ...]) -> Float64:
    """Centres of marks that the border cuts, if they are in view.

    The part in view is as deep as twice the distance of its centroid from the border.
    """
    last = np.array(shape[::-1]) - 1.0
    low, high = spots.cut[:, :2], spots.cut[:, 2:]
    from_low = 2 * (spots.centres + 0.5) - 0.5 - half_size
    from_high = last - (2 * (last - spots.centres + 0.5) - 0.5 - half_size)
    centres = np.where(low, np.minimum(from_low, spots.centres), spots.centres)
    centres = np.where(high, np.maximum(from_high, spots.centres), centres)
    return np.asarray(centres[((centres > -0.5) & (centres < last + 0.5)).all(1)])


def _taken_apart(spots: Spots, pitch: float, half_size: float) -> Float64:
    """Centres of the marks that make up each bar, evenly spaced along it."""
    return np.zeros((0, 2))


def _usual(peaks: UInt8) -> float:
    """How dark marks usually are.

    Much of the image lies beside a mark and shows its peak; the darker, the more it counts, so that
    grain between marks that lie far apart does not.
    """
    ordered = np.sort(peaks[::_SAMPLE_PX, ::_SAMPLE_PX], axis=None).astype(np.float64)
    weight = np.cumsum(ordered**2)
    return float(ordered[np.searchsorted(weight, weight[-1] / 2)])


def _odd(length: float) -> int:
    return 2 * int(length) + 1 if length >= 1 else 1


def _square(length: float) -> UInt8:
    side = 2 * int(length / 2) + 1
    return np.ones((side, side), np.uint8)
