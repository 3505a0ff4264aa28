"""Where the object touches, for slip: inside the ring where the skin is steep."""

from __future__ import annotations

from functools import reduce

import cv2
import numpy as np

from tactile_core.algorithms.arrays.places import struck
from tactile_core.algorithms.arrays.quantile import quantile
from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Array, Bool, Float32

_STRONGEST, _OF_STRONGEST = 0.99, 0.3
_GAP, _BESIDE, _LEAST_AREA = 4, 2, 6.0
"""Places: of a gap in the ring, of skin beside the contact that is bent, too, and of a speck."""

_SMOOTH = (3, 3)
_FEWEST_SEEN = 0.1
_MOVED_MM, _OF_FARTHEST = 0.02, 0.5


def small_image(pixels: Array, size_px: tuple[int, int], full_scale: float) -> Float32:
    """(h, w, K) mean intensities as a share of the full scale."""
    small = shrunk(pixels, size_px)
    small = np.asarray(small, np.float32) / np.float32(full_scale)
    return small if small.ndim == 3 else small[..., None]


def light_change(now: Float32, undeformed: Float32, hidden: Bool) -> Float32:
    """(h, w) how much the light of the skin changed, which is most where it became steepest.

    Parameters
    ----------
    now, undeformed : (h, w, K) float32
        Of :func:`small_image`.
    hidden : (h, w) bool
        Where a marker is, or was.
    """
    seen = (~hidden).astype(np.float32)
    change = reduce(np.maximum, cv2.split(cv2.absdiff(now, undeformed))) * seen
    return np.asarray(cv2.blur(change, _SMOOTH) / np.maximum(cv2.blur(seen, _SMOOTH), _FEWEST_SEEN))


def covered(points: Array, radius: float, shape: tuple[int, ...]) -> Bool:
    """(h, w) what lies this near to points (N, 2), x and y in places."""
    side = 2 * round(radius) + 1
    return np.asarray(cv2.dilate(struck(points, shape), np.ones((side, side), np.uint8))).view(
        np.bool_
    )


def touched_within(steep: Float32, least: float) -> Bool:
    """Tell the contact from the ring of steep skin around it.

    The skin is steepest, and its light changes most, at the border of a contact. What that
    border encloses is in contact, too: under a flat object the skin is level and looks untouched.
    A ring that leaves the view is closed there. Two places further out the skin is still bent and
    beside the contact.

    Parameters
    ----------
    steep : (h, w) float32
        :func:`~tactile_core.algorithms.arrays.gradient.steepness` or :func:`light_change`.
    least : float
        Of such a value at a border, at any press.

    Returns
    -------
    (h, w) bool
    """
    limit = max(least, _OF_STRONGEST * quantile(steep.ravel(), _STRONGEST))
    ring = np.pad((steep > limit).astype(np.uint8), _GAP)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _GAP + 1, 2 * _GAP + 1))
    closed = cv2.morphologyEx(ring, cv2.MORPH_CLOSE, disc)[_GAP:-_GAP, _GAP:-_GAP]
    borders, _ = cv2.findContours(closed.copy(), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    borders = [border for border in borders if cv2.contourArea(border) >= _LEAST_AREA]
    cut = [border for border in borders if _leaves(border, steep.shape)]
    whole = [border for border in borders if not _leaves(border, steep.shape)]
    whole += [np.concatenate(cut)] if cut else []
    mask = np.zeros(steep.shape, np.uint8)
    cv2.drawContours(mask, [cv2.convexHull(border) for border in whole], -1, 1, cv2.FILLED)
    inner = cv2.erode(mask, np.ones((3, 3), np.uint8), iterations=_BESIDE)
    return np.asarray(inner).view(np.bool_)


def touched_by_motion(moved_mm: Float32) -> Bool:
    """Tell the contact from the skin that is dragged along.

    Skin beside a contact is dragged less. An object larger than the view shows in nothing
    else. A purely pressing load is seen only by how far it spreads the skin.

    Parameters
    ----------
    moved_mm : (h, w) float32
        Size of the displacement.
    """
    farthest = float(np.quantile(moved_mm, 0.98))
    if farthest < _MOVED_MM:
        return np.zeros(moved_mm.shape, np.bool_)
    return np.asarray(moved_mm > _OF_FARTHEST * farthest)


def _leaves(border: Array, shape: tuple[int, ...]) -> bool:
    x, y = border[:, 0].T
    return bool(min(x.min(), y.min()) == 0 or x.max() == shape[1] - 1 or y.max() == shape[0] - 1)
