"""What is drawn over a picture of the skin: the contact's outline, marks, and how they moved."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.quantities import ContactMask, DisplacementField, MarkerField
from tactile_core.views.drawing import Colour, Rgb, round_length
from tactile_core.views.sheet import unit_of

_OUTLINE_BLUR_PX = 1.0
_OUTLINE, _HALO = (255, 255, 255), (45, 52, 62)
_ARROW: Colour = (196, 62, 40)
_MARK: Colour = (38, 46, 54)
_MARK_PX, _TIP_PX, _SHORTEST_PX = 2.2, 5.0, 5.0
_ACROSS = 20
_LONGEST_SPACINGS, _MOST_MAGNIFIED = 1.8, 10.0
_FINE = 4
"""Fractional bits of OpenCV's coordinates."""


def outline(picture: Rgb, contact: ContactMask) -> None:
    """Draw the border of the contact."""
    h, w = picture.shape[:2]
    smooth = cv2.resize(contact.mask.astype(np.float32), (w, h), interpolation=cv2.INTER_LINEAR)
    scale = w / contact.mask.shape[1]
    if scale > 1:
        smooth = cv2.GaussianBlur(smooth, (0, 0), _OUTLINE_BLUR_PX * scale)
    curves, _ = cv2.findContours(
        (smooth > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    line = max(2, round(unit_of(picture)))
    for colour, width in ((_HALO, line + 2), (_OUTLINE, line)):
        cv2.drawContours(picture, curves, -1, colour, width, cv2.LINE_AA)


def drag(
    picture: Rgb,
    markers: MarkerField | None,
    field: DisplacementField | None,
    *,
    scale: float = 1.0,
) -> str:
    """Draw where the marks are and how the skin was dragged.

    Marks are dots, hollow where they are not seen but inferred; arrows point from where each was on
    the untouched skin. Without marks, arrows stand on a grid where the field is valid.

    Parameters
    ----------
    picture : (H, W, 3) uint8
        Drawn upon.
    markers, field : quantity or None
        In the image of which ``picture`` is an enlargement.
    scale : float
        Size of a pixel of the image in the picture.

    Returns
    -------
    str
        How the arrows are enlarged: "arrows ×5"; empty where none are drawn.
    """
    if markers is not None:
        keep = np.isfinite(markers.px).all(axis=1)
        now, was = markers.px[keep], markers.reference_px[keep]
        spacing = _spacing(markers.reference_px)
        words = _arrows(picture, was, now - was, spacing, markers.mm_per_px, scale)
        radius = _MARK_PX * unit_of(picture)
        for place, seen in zip(_pixels(now, scale), markers.seen[keep], strict=True):
            _dot(picture, place, radius, hollow=not seen)
        return words
    if field is None:
        return ""
    step = max(1, field.mm.shape[1] // _ACROSS)
    y, x = np.mgrid[step // 2 : field.mm.shape[0] : step, step // 2 : field.mm.shape[1] : step]
    kept = field.valid[y, x]
    moved = field.mm[y, x][kept] / field.mm_per_px
    return _arrows(picture, np.stack([x, y], -1)[kept], moved, float(step), field.mm_per_px, scale)


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
    cv2.circle(picture, middle, size, _OUTLINE if hollow else _MARK, -1, cv2.LINE_AA, _FINE)
    if hollow:
        cv2.circle(picture, middle, size, _MARK, line, cv2.LINE_AA, _FINE)


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
