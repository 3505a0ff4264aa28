"""What is drawn over a camera's image: contact, markers, arrows, text."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.quantities.fields import Outline, Points, VectorMap
from tactile_core.views.shading import INK, Colour, Rgb, round_length, unit_of

_FRACTION_BITS = 4  # Fractional bits of OpenCV's coordinates


_WHITE: Colour = (255, 255, 255)  # R, G, B of outlines and of the border of arrows
_RED: Colour = (196, 62, 40)  # R, G, B of arrows
_ACROSS = 20  # Arrows along the width of a field
_LONGEST_SPACINGS = 1.8  # Longest magnified arrow relative to the spacing of the arrows


def outline(picture: Rgb, region: Outline) -> None:
    """Draw the border of a region."""
    h, w = picture.shape[:2]
    smooth = cv2.resize(region.mask.astype(np.float32), (w, h), interpolation=cv2.INTER_LINEAR)
    scale = w / region.mask.shape[1]
    if scale > 1:
        smooth = cv2.GaussianBlur(smooth, (0, 0), scale)
    curves, _ = cv2.findContours(
        (smooth > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    line = max(2, round(unit_of(picture)))
    for colour, width in ((INK, line + 2), (_WHITE, line)):
        cv2.drawContours(picture, curves, -1, colour, width, cv2.LINE_AA)


def points(picture: Rgb, at: Points, *, mm_per_px: float, scale: float = 1.0) -> str:
    """Draw points as dots, with arrows from their previous positions; unreliable ones are hollow.

    Parameters
    ----------
    picture : (H, W, 3) uint8
        Modified in place.
    at : Points
        In the coordinates of the image, which ``picture`` shows enlarged.
    mm_per_px : float
        Scale of the image.
    scale : float
        Enlargement: px of the picture per px of the image.

    Returns
    -------
    str
        The magnification of the arrows, e.g. "arrows ×5"; empty if none are drawn.
    """
    keep = np.isfinite(at.px).all(axis=1)
    now, words = at.px[keep], ""
    if at.from_px is not None:
        before, spacing = at.from_px[keep], _spacing(at.from_px)
        words = _arrows(picture, before, now - before, spacing, mm_per_px, scale)
    radius = 2.2 * unit_of(picture)
    reliable = np.ones(len(now), bool) if at.reliable is None else at.reliable[keep]
    for centre, is_reliable in zip(_pixels(now, scale), reliable, strict=True):
        _dot(picture, centre, radius, hollow=not is_reliable)
    return words


def vectors(picture: Rgb, field: VectorMap, *, mm_per_px: float, scale: float = 1.0) -> str:
    """Draw arrows on a grid in the valid part of a field.

    Parameters and result are those of :func:`points`. Arrows of a field that is not in mm are
    scaled to the grid, and the result is empty.
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
    """Draw arrows, magnified by a round number if they are small; return the magnification."""
    longest = float(np.linalg.norm(moved, axis=1).max(initial=0.0))
    if longest * mm_per_px < 1e-6:  # no arrows, and no division by zero
        return ""
    fitting = _LONGEST_SPACINGS * spacing / longest
    magnification = round_length(fitting) if fitting > 1 else 1.0
    magnification = min(magnification, 10.0)
    unit = unit_of(picture)
    starts, ends = _pixels(at, scale), _pixels(at + magnification * moved, scale)
    long = np.linalg.norm(ends - starts, axis=1) > 5 * unit  # shorter ones are dots
    if not long.any():
        return ""
    for colour, width in ((_WHITE, 3.2), (_RED, 1.6)):
        for start, end in zip(starts[long], ends[long], strict=True):
            _arrow(picture, start, end, colour, max(1, round(width * unit)), unit)
    return f"arrows ×{magnification:g}"


def _arrow(picture: Rgb, start: Array, end: Array, colour: Colour, width: int, unit: float) -> None:
    length = float(np.hypot(*(end - start)))
    tip = min(0.5, 5 * unit / length)
    ((x0, y0), (x1, y1)) = (_fixed_point(point) for point in (start, end))
    cv2.arrowedLine(picture, (x0, y0), (x1, y1), colour, width, cv2.LINE_AA, _FRACTION_BITS, tip)


def _dot(picture: Rgb, centre: Array, radius: float, *, hollow: bool) -> None:
    size = round(radius * 2**_FRACTION_BITS)
    line = max(1, round(radius / 2))
    at = _fixed_point(centre)
    fill = _WHITE if hollow else INK
    cv2.circle(picture, at, size, fill, -1, cv2.LINE_AA, _FRACTION_BITS)
    if hollow:
        cv2.circle(picture, at, size, INK, line, cv2.LINE_AA, _FRACTION_BITS)


def _fixed_point(point: Array) -> tuple[int, int]:
    x, y = np.rint(point * 2**_FRACTION_BITS).astype(int)
    return int(x), int(y)


def _pixels(points: Array, scale: float) -> Array:
    """Convert image coordinates to those of the enlarged picture."""
    return np.asarray((points + 0.5) * scale - 0.5)


def _spacing(points: Array) -> float:
    """Mean distance of adjacent points, px, from their number and bounding box."""
    if len(points) < 2:
        return float(_ACROSS)
    sides = np.maximum(np.ptp(points, axis=0), 1.0)
    return float(np.sqrt(np.prod(sides) / len(points)))
