"""What is drawn over a camera's image: contact, markers, arrows, text."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array
from tactile_core.quantities.fields import Outline, Points, VectorMap
from tactile_core.views.shading import Colour, Rgb, round_length, unit_of

_FRACTION_BITS = 4  # Fractional bits of OpenCV's coordinates


class OVERLAY:
    """Style of overlays. It has no effect on measurements, so nothing sets it from outside.

    Lengths in sheet px are px on the smallest sheet and grow with the picture.
    """

    # [px] Sigma that smooths the outline of an enlarged mask, in px of the image.
    outline_blur_px = 1.0
    # [grey levels] R, G, B of outlines and of the dark border around them.
    outline_rgb: Colour = (255, 255, 255)
    halo_rgb: Colour = (45, 52, 62)
    # [grey levels] R, G, B of markers and arrows.
    marker_rgb: Colour = (38, 46, 54)
    arrow_rgb: Colour = (196, 62, 40)
    marker_radius = 2.2  # [sheet px] Radius of the dot of a marker
    # [sheet px] Line width of an arrow, without and with its light border.
    arrow_line = 1.6
    arrow_halo = 3.2
    arrow_tip = 5.0  # [sheet px] Length of the arrowhead
    shortest_arrow = 5.0  # [sheet px] Shorter arrows are left out
    # [mm] A field whose largest displacement is smaller has no arrows. Source: by hand, to avoid
    # a division by zero.
    smallest_mm = 1e-6
    arrows_across = 20  # [count] Arrows along the width of a field
    # [ratio] Limit of the longest magnified arrow relative to the spacing of the arrows.
    longest_spacings = 1.8
    max_magnification = 10.0  # [ratio] Limit of the magnification of displacements


def outline(picture: Rgb, region: Outline) -> None:
    """Draw the border of a region."""
    h, w = picture.shape[:2]
    smooth = cv2.resize(region.mask.astype(np.float32), (w, h), interpolation=cv2.INTER_LINEAR)
    scale = w / region.mask.shape[1]
    if scale > 1:
        smooth = cv2.GaussianBlur(smooth, (0, 0), OVERLAY.outline_blur_px * scale)
    curves, _ = cv2.findContours(
        (smooth > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    line = max(2, round(unit_of(picture)))
    for colour, width in ((OVERLAY.halo_rgb, line + 2), (OVERLAY.outline_rgb, line)):
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
    radius = OVERLAY.marker_radius * unit_of(picture)
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
    step = max(1, width // OVERLAY.arrows_across)
    y, x = np.mgrid[step // 2 : height : step, step // 2 : width : step]
    kept = np.ones(y.shape, bool) if field.valid is None else field.valid[y, x]
    values = field.values[y, x][kept]
    is_length = field.unit == "mm"
    if not is_length:
        longest = float(np.linalg.norm(values, axis=1).max(initial=0.0)) or 1.0
        values = values * (mm_per_px * step * OVERLAY.longest_spacings / longest)
    at = np.stack([x, y], -1)[kept]
    words = _arrows(picture, at, values / mm_per_px, float(step), mm_per_px, scale)
    return words if is_length else ""


def _arrows(
    picture: Rgb, at: Array, moved: Array, spacing: float, mm_per_px: float, scale: float
) -> str:
    """Draw arrows, magnified by a round number if they are small; return the magnification."""
    longest = float(np.linalg.norm(moved, axis=1).max(initial=0.0))
    if longest * mm_per_px < OVERLAY.smallest_mm:
        return ""
    fitting = OVERLAY.longest_spacings * spacing / longest
    magnification = round_length(fitting) if fitting > 1 else 1.0
    magnification = min(magnification, OVERLAY.max_magnification)
    unit = unit_of(picture)
    starts, ends = _pixels(at, scale), _pixels(at + magnification * moved, scale)
    long = np.linalg.norm(ends - starts, axis=1) > OVERLAY.shortest_arrow * unit
    if not long.any():
        return ""
    halo, line = (
        (OVERLAY.outline_rgb, OVERLAY.arrow_halo),
        (OVERLAY.arrow_rgb, OVERLAY.arrow_line),
    )
    for colour, width in (halo, line):
        for start, end in zip(starts[long], ends[long], strict=True):
            _arrow(picture, start, end, colour, max(1, round(width * unit)), unit)
    return f"arrows ×{magnification:g}"


def _arrow(picture: Rgb, start: Array, end: Array, colour: Colour, width: int, unit: float) -> None:
    length = float(np.hypot(*(end - start)))
    tip = min(0.5, OVERLAY.arrow_tip * unit / length)
    ((x0, y0), (x1, y1)) = (_fixed_point(point) for point in (start, end))
    cv2.arrowedLine(picture, (x0, y0), (x1, y1), colour, width, cv2.LINE_AA, _FRACTION_BITS, tip)


def _dot(picture: Rgb, centre: Array, radius: float, *, hollow: bool) -> None:
    size = round(radius * 2**_FRACTION_BITS)
    line = max(1, round(radius / 2))
    at = _fixed_point(centre)
    fill = OVERLAY.outline_rgb if hollow else OVERLAY.marker_rgb
    cv2.circle(picture, at, size, fill, -1, cv2.LINE_AA, _FRACTION_BITS)
    if hollow:
        cv2.circle(picture, at, size, OVERLAY.marker_rgb, line, cv2.LINE_AA, _FRACTION_BITS)


def _fixed_point(point: Array) -> tuple[int, int]:
    x, y = np.rint(point * 2**_FRACTION_BITS).astype(int)
    return int(x), int(y)


def _pixels(points: Array, scale: float) -> Array:
    """Convert image coordinates to those of the enlarged picture."""
    return np.asarray((points + 0.5) * scale - 0.5)


def _spacing(points: Array) -> float:
    """Mean distance of adjacent points, px, from their number and bounding box."""
    if len(points) < 2:
        return float(OVERLAY.arrows_across)
    sides = np.maximum(np.ptp(points, axis=0), 1.0)
    return float(np.sqrt(np.prod(sides) / len(points)))


class ARROWS:
    """Style of the arrows. It has no effect on measurements, so nothing sets it from outside."""

    width_px = 960  # [px] Width of the result
    # [ratio] Brightness of the picture under the arrows, relative to the original.
    brightness = 0.75
    arrows_across = 28  # [count] Arrows along the width
    # [ratio] Length of the longest arrow relative to the spacing of the arrows.
    longest_spacings = 1.6
    shortest_px = 1.5  # [px] Shorter arrows are left out
    # [grey levels] R, G, B of arrows in the stick region, of arrows in the slip region, and of
    # the contour of either.
    stick_rgb = (255, 220, 60)
    slip_rgb = (255, 70, 40)
    edge_rgb = (30, 30, 30)
    # [px] Line width of an arrow, without and with its contour.
    line_px = 2
    edge_px = 4
    tip = 0.3  # [ratio] Length of the arrowhead relative to the arrow


def arrows(
    pixels: NDArray[np.uint8],
    displacement_mm: NDArray[Any],
    *,
    slips: NDArray[np.bool_] | None = None,
) -> NDArray[np.uint8]:
    """Draw a displacement field over a picture.

    Parameters
    ----------
    pixels : (H, W, 3) uint8
        RGB.
    displacement_mm : (H, W, 2)
        +x right, +y down. The longest arrow is a little longer than the spacing of the arrows.
    slips : (H, W) bool, optional
        Slip region, where the gel surface slides along the object; its arrows are red.

    Returns
    -------
    (H', W', 3) uint8
        960 px wide.
    """
    height, width = pixels.shape[:2]
    zoom = ARROWS.width_px / width
    size = (ARROWS.width_px, round(height * zoom))
    enlarged = cv2.resize(pixels, size, interpolation=cv2.INTER_CUBIC)
    dimmed = enlarged * np.float32(ARROWS.brightness)
    picture = np.ascontiguousarray(dimmed.astype(np.uint8))
    step = max(1, width // ARROWS.arrows_across)
    longest = float(np.linalg.norm(displacement_mm, axis=2).max())
    scale = ARROWS.longest_spacings * step * zoom / longest if longest > 0 else 0.0
    for y in range(step // 2, height, step):
        for x in range(step // 2, width, step):
            right, down = scale * displacement_mm[y, x]
            if np.hypot(right, down) < ARROWS.shortest_px:
                continue
            colour = ARROWS.slip_rgb if slips is not None and slips[y, x] else ARROWS.stick_rgb
            start = round(zoom * x), round(zoom * y)
            end = round(zoom * x + right), round(zoom * y + down)
            for rgb, line in ((ARROWS.edge_rgb, ARROWS.edge_px), (colour, ARROWS.line_px)):
                cv2.arrowedLine(picture, start, end, rgb, line, cv2.LINE_AA, tipLength=ARROWS.tip)
    return picture
