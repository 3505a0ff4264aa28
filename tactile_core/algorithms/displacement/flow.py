"""How the picture of a contact moves from frame to frame, for skins without markers."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Array, Float32

_LONGEST_SIDE_PX = 320
_DETAIL_PX = 6.0
_NEIGHBOURHOOD_PX = (29, 29)
_FAINT_SHARE = 0.006
_GREY, _CONTRAST = 128.0, 40.0
_LONE = np.outer([1, -2, 1], [1, -2, 1]).astype(np.float32) / 6
_NOISE_SHARE, _NORMAL_MEDIAN, _SAMPLED = 1.2, 0.6745, 3
_LEAST_WEIGHT = 0.1
_COARSER = 4


@dataclass(frozen=True, eq=False)
class Imprint:
    """What an object adds to the picture of the untouched skin, made even in light and contrast.

    Attributes
    ----------
    grey : (h, w) uint8
        Shrunk to at most 320 px; 128 where nothing is added.
    weight : (h, w) float32
        0…1: how much there is to follow.
    """

    grey: NDArray[np.uint8]
    weight: Float32


def detail(pixels: Array, full_scale: float) -> Float32:
    """Return what is finer than the light's own changes, so that its drift drops out.

    Parameters
    ----------
    pixels : (H, W, K)
    full_scale : float
        Largest intensity.

    Returns
    -------
    (h, w) float32
        Shrunk to at most 320 px; 1 is the full scale.
    """
    factor = max(1.0, max(pixels.shape[:2]) / _LONGEST_SIDE_PX)
    height, width = (max(1, round(side / factor)) for side in pixels.shape[:2])
    small = shrunk(pixels, (width, height)).reshape(height, width, -1)
    share = np.full((1, small.shape[2]), 1 / (small.shape[2] * full_scale), np.float32)
    bright = (small.astype(np.float32) @ share[0]).astype(np.float32)
    return np.asarray(bright - cv2.GaussianBlur(bright, (0, 0), _DETAIL_PX), np.float32)


def imprint(now: Float32, undeformed: Float32) -> Imprint:
    """Return the imprint that a frame's :func:`detail` shows over that of the untouched skin."""
    added = now - undeformed
    energy = cv2.blur(cv2.blur(added * added, _NEIGHBOURHOOD_PX), _NEIGHBOURHOOD_PX)
    energy = np.maximum(energy - np.float32(_noise_energy(added)), 0)
    energy *= np.float32(_FAINT_SHARE**-2)
    even = added * (np.float32(_CONTRAST / _FAINT_SHARE) / np.sqrt(energy + 1))
    grey = np.clip(even + np.float32(_GREY), 0, 255).astype(np.uint8)
    return Imprint(grey, np.asarray(1 - 1 / (1 + energy * energy), np.float32))


def motion(earlier: Imprint, now: Imprint, start_px: Float32) -> Float32:
    """Return how far what is now at each pixel has moved, by dense inverse search (DIS).

    Parameters
    ----------
    earlier, now : Imprint
        Of one size.
    start_px : (h, w, 2) float32
        From where to search.

    Returns
    -------
    (h, w, 2) float32
        In px; of no meaning where there is nothing to follow, see :func:`settled`.
    """
    # made anew: it keeps buffers, which two threads must not share
    search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    return np.asarray(-search.calc(now.grey, earlier.grey, -start_px), np.float32)


def settled(moved_px: Float32, weight: Float32, *, reach_px: float) -> Float32:
    """Return a motion that is that of the surroundings where nothing shows, and 0 far from all.

    Parameters
    ----------
    moved_px : (h, w, 2) float32
    weight : (h, w) float32
        0…1: how far the motion is to be trusted.
    reach_px : float
        How far what moves takes the skin around it along.

    Returns
    -------
    (h, w, 2) float32
    """
    height, width = weight.shape
    trusted = np.dstack([moved_px * weight[..., None], weight])
    small = shrunk(trusted, (max(1, width // _COARSER), max(1, height // _COARSER)))
    wide = cv2.GaussianBlur(small, (0, 0), reach_px / _COARSER)
    around = wide[..., :2] / (wide[..., 2:] + np.float32(_LEAST_WEIGHT))
    around = cv2.resize(around, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(around + weight[..., None] * (moved_px - around), np.float32)


def followed(before_px: Float32, moved_px: Float32) -> Float32:
    """Return the sum of two motions at the present place of what moved: ``before``, then ``moved``.

    Parameters
    ----------
    before_px, moved_px : (h, w, 2) float32
        Each told at the place that its motion ended in.
    """
    height, width = moved_px.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    was_x, was_y = x - moved_px[..., 0], y - moved_px[..., 1]
    before = cv2.remap(before_px, was_x, was_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved_px + before, np.float32)


def _noise_energy(added: Float32) -> float:
    """Mean square of what no neighbour shares [Immerkær 1996], were it noise all of it."""
    lone = cv2.filter2D(added, cv2.CV_32F, _LONE)[1:-1:_SAMPLED, 1:-1:_SAMPLED]
    return float(_NOISE_SHARE * (np.median(np.abs(lone).astype(np.float64)) / _NORMAL_MEDIAN) ** 2)
