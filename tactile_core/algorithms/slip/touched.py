"""Where the object touches, for slip on a sensor that measures no height."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.quantile import quantile
from tactile_core.algorithms.shrinking import shrunk

Array = NDArray[Any]
Bool = NDArray[np.bool_]
Float32 = NDArray[np.float32]

_LEAST_CHANGE, _NOISES, _OF_STRONGEST = 0.02, 5.0, 0.3
_STRONGEST = 0.99
_WITHOUT_MARKS, _BESIDE = 5, 2
_MOVED_MM, _OF_FARTHEST = 0.02, 0.5


def small_image(pixels: Array, size_px: tuple[int, int], full_scale: float) -> Float32:
    """(h, w, K) mean intensities as a share of the full scale."""
    small = shrunk(pixels, size_px)
    small = np.asarray(small, np.float32) / np.float32(full_scale)
    return small if small.ndim == 3 else small[..., None]


def touched_by_image(now: Float32, untouched: Float32, noise: float = 0.0) -> tuple[Bool, float]:
    """Tell the contact from the change of the light.

    The skin is steepest, and its light changes most, at the border of a contact. What that border
    encloses is in contact, too: under a flat object the skin is level and looks untouched.
    Two places further out the skin is still bent and beside the contact.
    Marks that move are smaller than a contact and filtered away.

    Parameters
    ----------
    now, untouched : (h, w, K) float32
        Of :func:`small_image`.
    noise : float
        Of an intensity, as a share of the full scale.

    Returns
    -------
    mask : (h, w) bool
    strength : float
        The change summed over the image: it grows with the load.
    """
    change = cv2.medianBlur(np.abs(now - untouched).max(axis=2), _WITHOUT_MARKS)
    least = max(
        _LEAST_CHANGE, _NOISES * noise, _OF_STRONGEST * quantile(change.ravel(), _STRONGEST)
    )
    changed = (change > least).astype(np.uint8)
    borders, _ = cv2.findContours(changed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros_like(changed)
    cv2.drawContours(filled, borders, -1, 1, cv2.FILLED)
    mask = cv2.erode(filled, np.ones((3, 3), np.uint8), iterations=_BESIDE).astype(bool)
    return mask, float(change.sum())


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
