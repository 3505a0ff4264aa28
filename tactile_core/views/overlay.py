"""What is drawn over a picture of the skin: the contact's outline, markers, and how they moved."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.quantities.layers import Outline, Points, VectorMap
from tactile_core.views.drawing import Colour, Rgb, round_length
from tactile_core.views.sheet import unit_of

_OUTLINE_BLUR_PX = 1.0
_OUTLINE, _HALO = (255, 255, 255), (45, 52, 62)
_ARROW: Colour = (196, 62, 40)
_MARKER: Colour = (38, 46, 54)
_MARKER_PX, _TIP_PX, _SHORTEST_PX = 2.2, 5.0, 5.0
_ACROSS = 20
_LONGEST_SPACINGS, _MOST_MAGNIFIED = 1.8, 10.0
_FINE = 4
"""Fractional bits of OpenCV's coordinates."""


def outline(picture: Rgb, region: Outline) -> None:
    """Draw the border of a region."""
    h, w = picture.shape[:2]
    smooth = cv2.resize(region.mask.astype(np.float32), (w, h), interpolation=cv2.INTER_LINEAR)
    scale = w / region.mask.shape[1]
    if scale > 1:
        smooth = cv2.GaussianBlur(smooth, (0, 0), _OUTLINE_BLUR_PX * scale)
    curves, _ = cv2.findContours(
        (smooth > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    line = max(2, round(unit_of(picture)))
    for colour, width in ((_HALO, line + 2), (_OUTLINE, line)):
        cv2.drawContours(picture, curves, -1, colour, width, cv2.LINE_AA)


def points(picture: Rgb, at: Points, *, mm_per_px: float, scale: float = 1.0) -> str:
    """Draw points as dots, hollow where they are not sure, with arrows from where they were.

    Parameters
    ----------
    picture : (H, W, 3) uint8
        Drawn upon.
    at : Points
        In the image of which ``picture`` is an enlargement.
    mm_per_px : float
        Of that image.
    scale : float
        Size of a pixel of the image in the picture.

    Returns
    -------
    str
        How the arrows are enlarged: "arrows ×5"; empty where none are drawn.
    """
    keep = np.isfinite(at.px).all(axis=1)
    now, words = at.px[keep], ""
    if at.from_px is not None:
        was, spacing = at.from_px[keep], _spacing(at.from_px)
        words = _arrows(picture, was, now - was, spacing, mm_per_px, scale)
    radius = _MARKER_PX * unit_of(picture)
    sure = np.ones(len(now), bool) if at.reliable is None else at.reliable[keep]
    for place, is_sure in zip(_pixels(now, scale), sure, strict=True):
        _dot(picture, place, radius, hollow=not is_sure)
    return words


def vectors(picture: Rgb, field: VectorMap, *, mm_per_px: float, scale: float = 1.0) -> str:
    """Draw arrows on a grid where a field is valid.

    Parameters and the result are those of :func:`points`. Arrows of another unit than mm are
    drawn as long as fits, and no scale is given.
    """
    height, width = field.values.shape[:2]
    step = max(1, width // _ACROSS)
    y, x = np.mgrid[step // 2 : height : step, step // 2 : width : step]
    kept = np.ones(y.shape, bool) if field.valid is None else field.valid[y, x]
    values = field.values[y, x][kept]
    is_length = field.unit == "mm"
    if not is_length:
        longest = float(np.linalg.norm(values, axis=1).max(initial=0.0)) or 1.0
        values = values * (mm_per_px * step * _LONGEST_SPACINGS / longest)
    at = np.stack([x, y], -1)[kept]
    words = _arrows(picture, at, values / mm_per_px, float(step), mm_per_px, scale)
    return words if is_length else ""


def _arrows(
    picture: Rgb, at: Array, moved: Array, spacing: float, mm_per_px: float, scale: float
) -> str:
    """Draw arrows, the longest somewhat longer than their spacing; say how magnified they are."""
    longest = float(np.linalg.norm(moved, axis=1).max(initial=0.0))
    if longest * mm_per_px < 1e-6:
        return ""
    wanted = _LONGEST_SPACINGS * spacing / longest
    times = round_length(wanted) if wanted > 1 else 1.0
    times = min(times, _MOST_MAGNIFIED)
    unit = unit_of(picture)
    starts, ends = _pixels(at, scale), _pixels(at + times * moved, scale)
    long = np.linalg.norm(ends - starts, axis=1) > _SHORTEST_PX * unit
    if not long.any():
        return ""
    for colour, width in ((_OUTLINE, 3.2), (_ARROW, 1.6)):
        for start, end in zip(starts[long], ends[long], strict=True):
            _arrow(picture, start, end, colour, max(1, round(width * unit)), unit)
    return f"arrows ×{times:g}"


def _arrow(picture: Rgb, start: Array, end: Array, colour: Colour, width: int, unit: float) -> None:
    length = float(np.hypot(*(end - start)))
    tip = min(0.5, _TIP_PX * unit / length)
    ((x0, y0), (x1, y1)) = (_fine(point) for point in (start, end))
    cv2.arrowedLine(picture, (x0, y0), (x1, y1), colour, width, cv2.LINE_AA, _FINE, tip)


def _dot(picture: Rgb, place: Array, radius: float, *, hollow: bool) -> None:
    size = round(radius * 2**_FINE)
    line = max(1, round(radius / 2))
    middle = _fine(place)
    cv2.circle(picture, middle, size, _OUTLINE if hollow else _MARKER, -1, cv2.LINE_AA, _FINE)
    if hollow:
        cv2.circle(picture, middle, size, _MARKER, line, cv2.LINE_AA, _FINE)


def _fine(point: Array) -> tuple[int, int]:
    x, y = np.rint(point * 2**_FINE).astype(int)
    return int(x), int(y)


def _pixels(points: Array, scale: float) -> Array:
    """Points of the image in its enlargement."""
    return np.asarray((points + 0.5) * scale - 0.5)


def _spacing(points: Array) -> float:
    """Typical distance of neighbours, from how many there are on how much area."""
    if len(points) < 2:
        return float(_ACROSS)
    sides = np.maximum(np.ptp(points, axis=0), 1.0)
    return float(np.sqrt(np.prod(sides) / len(points)))
