"""Where a contact is: inside steep surface, a change of light, or the surface that moves."""

from __future__ import annotations

from functools import cache, reduce

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.shrinking import shrink_image, steepness
from tactile_core.algorithms.arrays.types import (
    Array,
    Bool,
    Float32,
    UInt8,
    rasterise_points,
)
from tactile_core.algorithms.slip.plane import sample_cells

# [share of the maximum] Steepness above which a point belongs to the ring at the border of a
# contact: chosen on virtual contacts (ADR 29)
_EDGE_SHARE = 0.3
_GAP = 4  # [grid points] Radius of the closing that bridges gaps in the ring
_SMOOTHING = 3  # [grid points] Side of the box filter of the change of light
_MOVED_SHARE = 0.5  # [share of the maximum] Displacement above which a point is in contact (ADR 29)


def small_image(pixels: Array, size_px: tuple[int, int], full_scale: float) -> Float32:
    """Reduce an image to (h, w, K) float32, as a share of the full scale."""
    small = shrink_image(pixels, size_px)
    small = np.asarray(small, np.float32) / np.float32(full_scale)
    return small if small.ndim == 3 else small[..., None]


def light_change(now: Float32, undeformed: Float32, hidden: Bool) -> Float32:
    """Return the change of light (h, w), which is largest where the surface is steepest.

    Parameters
    ----------
    now, undeformed : (h, w, K) float32
        From :func:`small_image`.
    hidden : (h, w) bool
        Points that a marker covers in either image.
    """
    box = (_SMOOTHING, _SMOOTHING)
    seen = (~hidden).astype(np.float32)
    change = reduce(np.maximum, cv2.split(cv2.absdiff(now, undeformed))) * seen
    visible = np.maximum(cv2.blur(seen, box), 0.1)  # no division by zero
    return np.asarray(cv2.blur(change, box) / visible)


def mask_squares(points: Array, radius: float, shape: tuple[int, ...]) -> Bool:
    """Mask (h, w) of the squares of this half side around points (N, 2), x and y."""
    side = 2 * round(radius) + 1
    return np.asarray(
        cv2.dilate(rasterise_points(points, shape), np.ones((side, side), np.uint8))
    ).view(np.bool_)


def steepness_of(
    cells: Float32,
    step_px: int,
    image_shape: tuple[int, int],
    stride: int,
    *,
    spacing_mm: float,
) -> tuple[Float32, float]:
    """Return the steepness of a height map on the grid of slip, and its :func:`peak`.

    Parameters
    ----------
    cells, step_px, image_shape, stride
        The height map, as for :func:`~tactile_core.algorithms.slip.plane.sample_cells`.
    spacing_mm : float
        Distance between neighbouring grid points.

    Returns
    -------
    steep : (h, w) float32
    steepest : float
    """
    steep = steepness(sample_cells(cells, step_px, image_shape, stride), spacing_mm, smooth=True)
    return steep, peak(steep)


def peak(steep: Float32) -> float:
    """Return the steepness (h, w) that counts as its maximum."""
    return quantile(steep.ravel(), 0.99)  # [share] robust against a few outliers


def contact_within_ring(
    steep: Float32, min_steepness: float, steepest: float | None = None
) -> Bool:
    """Return the contact area inside the steep ring at its border.

    The gel surface is steepest, and its light changes most, at the border of a contact. The area
    inside is in contact as well, although under a flat object it is level and looks undeformed. A
    ring that leaves the view is closed at the border of the view. The surface just outside the
    contact is also steep, so the area is eroded by two grid points.

    Parameters
    ----------
    steep : (h, w) float32
        :func:`~tactile_core.algorithms.arrays.shrinking.steepness` or :func:`light_change`.
    min_steepness : float
        Minimum steepness at the border of any contact.
    steepest : float, optional
        :func:`peak` of ``steep``, if it is known.

    Returns
    -------
    (h, w) bool
    """
    if steepest is None:
        steepest = peak(steep)
    limit = max(min_steepness, _EDGE_SHARE * steepest)
    gap, above = _GAP, (steep > limit).view(np.uint8)
    left, top, width, height = cv2.boundingRect(above)
    if width == 0:
        return above.view(np.bool_)
    # a closing stays within the box around what it closes
    inside, sides = above[top : top + height, left : left + width], (gap, gap, gap, gap)
    ring = cv2.copyMakeBorder(inside, *sides, cv2.BORDER_CONSTANT)
    closed = cv2.morphologyEx(ring, cv2.MORPH_CLOSE, _disc(gap))[gap:-gap, gap:-gap]
    borders, _ = cv2.findContours(
        closed.copy(), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE, offset=(left, top)
    )
    whole, truncated = list[Array](), list[Array]()
    for border in borders:
        if cv2.contourArea(border) >= 6.0:  # [grid points] smaller ones are specks
            (truncated if _leaves(border, steep.shape) else whole).append(border)
    whole += [np.concatenate(truncated)] if truncated else []
    mask = np.zeros(steep.shape, np.uint8)
    for border in whole:
        # one by one, because OpenCV leaves out where two of several contours overlap
        cv2.drawContours(mask, [cv2.convexHull(border)], -1, 1, cv2.FILLED)
    # [grid points] On virtual contacts the surface outside is steep as well (ADR 29)
    inner = cv2.erode(mask, _SQUARE, iterations=2)
    return np.asarray(inner).view(np.bool_)


def contact_from_motion(moved_mm: Float32) -> Bool:
    """Return the contact area as the surface that is sheared furthest.

    The surface around a contact is sheared less. This is the only cue of an object larger than the
    view. Without shear, a normal load shows only by the spread of the surface.

    Parameters
    ----------
    moved_mm : (h, w) float32
        Magnitude of the displacement.

    Returns
    -------
    (h, w) bool
    """
    farthest = float(np.quantile(moved_mm, 0.98))  # [share] robust against a few outliers
    if farthest < 0.02:  # [mm] less shows no contact
        return np.zeros(moved_mm.shape, np.bool_)
    return np.asarray(moved_mm > _MOVED_SHARE * farthest)


def _leaves(border: Array, shape: tuple[int, ...]) -> bool:
    left, top, width, height = cv2.boundingRect(border)
    return min(left, top) == 0 or left + width == shape[1] or top + height == shape[0]


@cache
def _disc(radius: int) -> UInt8:
    side = 2 * radius + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)), np.uint8)


_SQUARE = np.ones((3, 3), np.uint8)  # Neighbourhood of a grid point


def rim_share(mask: Bool) -> float:
    """Return the share of the border of the view that a mask (h, w) covers; corners count twice."""
    return float(np.mean(np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])))
