"""Maps of measurements in colour, with a scale bar, a colour bar and overlays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.quantities.fields import Outline, Points, ScalarMap, Surface, VectorMap
from tactile_core.views import overlay
from tactile_core.views.shading import (
    MIN_SIDE_PX,
    Rgb,
    colours,
    diverging_colours,
    frame_picture,
    sequential_colours,
    shade_heights,
)


@dataclass(frozen=True)
class Overlay:
    """Outlines, points and arrows that are drawn over a map.

    Attributes
    ----------
    outlines : sequence of Outline
    points : sequence of Points
    vectors : VectorMap or None
        Drawn as arrows on a grid, unless the points have arrows.
    """

    outlines: Sequence[Outline] = ()
    points: Sequence[Points] = ()
    vectors: VectorMap | None = None

    def draw(self, picture: Rgb, *, mm_per_px: float, scale: float) -> str:
        """Draw the overlay; return the magnification of its arrows as text."""
        for region in self.outlines:
            overlay.outline(picture, region)
        words = [
            overlay.points(picture, at, mm_per_px=mm_per_px, scale=scale) for at in self.points
        ]
        if self.vectors is not None and not any(at.from_px is not None for at in self.points):
            words.append(overlay.vectors(picture, self.vectors, mm_per_px=mm_per_px, scale=scale))
        return join_texts(words)

    def facts(self, mm_per_px: float) -> list[str]:
        """Return title and area of each region as text."""
        areas = [(r.title, np.count_nonzero(r.mask) * mm_per_px**2) for r in self.outlines]
        return [f"{title} {area:.2f} mm²" for title, area in areas]


def relief(
    height: Surface,
    over: Overlay | None = None,
    *,
    title: str = "",
    span_mm: tuple[float, float] | None = None,
) -> Rgb:
    """Draw a height map as shaded relief with a scale bar and a colour bar in mm.

    The longer side is at least 640 px, so that labels are legible for low-resolution sensors too.
    The colour bar spans at least the size of one pixel on the gel, so that noise does not fill it.

    Parameters
    ----------
    height : Surface
        An all-zero map has a uniform colour.
    over : Overlay, optional
    title : str
        Begins the line above the picture, e.g. the name of the observation.
    span_mm : (lowest, highest), optional
        Heights of the first and the last colour; pass the same to pictures that are compared.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    over = over or Overlay()
    surface, scale = _enlarge_values(height.mm)
    low, high = span_mm or (min(0.0, float(height.mm.min())), float(height.mm.max()))
    high = max(high, low + height.mm_per_px)
    picture = shade_heights(surface, height.mm_per_px / scale, low, high)
    arrows = over.draw(picture, mm_per_px=height.mm_per_px, scale=scale)
    highest = f"max {float(height.mm.max()):.3f} mm"
    return frame_picture(
        picture,
        mm_per_px=height.mm_per_px / scale,
        bar=colours(picture.shape[0]),
        span=(low, high),
        title=title,
        facts=join_texts([highest, *over.facts(height.mm_per_px), arrows]),
    )


def magnitude(field: VectorMap, over: Overlay, mm_per_px: float, *, title: str = "") -> Rgb:
    """Draw a vector field as a map of the magnitude, with arrows for the direction.

    Invalid parts of the map are paler. For a field in mm, the colour bar spans at least the size
    of one pixel on the gel.

    Parameters
    ----------
    field : VectorMap
    over : Overlay
        Arrows begin at its points if these have arrows, else on a grid.
    mm_per_px : float
    title : str
        Begins the line above the picture.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B, as large as the :func:`relief` of the same image.
    """
    size = np.hypot(field.values[..., 0], field.values[..., 1])
    surface, scale = _enlarge_values(size)
    least = mm_per_px if field.unit == "mm" else np.finfo(np.float32).tiny
    high = max(float(size.max()), float(least))
    picture = sequential_colours(surface / np.float32(high))
    if field.valid is not None:
        valid = cv2.resize(field.valid.view(np.uint8), surface.shape[::-1])[..., None] > 0
        picture = np.where(valid, picture, picture // 2 + 127).astype(np.uint8)
    both = Overlay(over.outlines, over.points, field)
    arrows = both.draw(picture, mm_per_px=mm_per_px, scale=scale)
    return frame_picture(
        picture,
        mm_per_px=mm_per_px / scale,
        bar=colours(picture.shape[0]),
        span=(0.0, high),
        unit=field.unit,
        title=title,
        facts=join_texts([f"max {size.max():.3f} {field.unit}".rstrip(), arrows]),
    )


def colour_field(field: ScalarMap, over: Overlay, mm_per_px: float, *, title: str = "") -> Rgb:
    """Draw a scalar field in colour; the colour bar spans its values.

    Parameters
    ----------
    field : ScalarMap
    over : Overlay
    mm_per_px : float
    title : str
        Begins the line above the picture.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B, as large as the :func:`relief` of the same image.
    """
    values = field.values.astype(np.float32)
    low, high = float(values.min()), float(values.max())
    if not high > low:
        high = low + (abs(low) or 1.0)
    surface, scale = _enlarge_values(values)
    picture = sequential_colours((surface - np.float32(low)) / np.float32(high - low))
    arrows = over.draw(picture, mm_per_px=mm_per_px, scale=scale)
    return frame_picture(
        picture,
        mm_per_px=mm_per_px / scale,
        bar=colours(picture.shape[0]),
        span=(low, high),
        unit=field.unit,
        title=title,
        facts=join_texts([f"{low:.4g} to {high:.4g} {field.unit}".rstrip(), arrows]),
    )


def deviation(measured: Surface, truth: Surface, *, most_mm: float, title: str = "") -> Rgb:
    """Draw the error of a height map: red is too high, blue too low, white correct.

    Parameters
    ----------
    measured, truth : Surface
        Of the same size and scale.
    most_mm : float
        Error with the strongest colour; pass the same to pictures that are compared.
    title : str
        Begins the line above the picture.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B, as large as the :func:`relief` of the same map.
    """
    error_mm = measured.mm - truth.mm
    most = max(most_mm, 1e-6)
    surface, scale = _enlarge_values(error_mm)
    rms = float(np.sqrt(np.mean(np.square(error_mm))))
    picture = diverging_colours(surface / np.float32(most))
    return frame_picture(
        picture,
        mm_per_px=measured.mm_per_px / scale,
        bar=diverging_colours(np.linspace(-1, 1, picture.shape[0], dtype=np.float32)),
        span=(-most, most),
        title=title,
        facts=f"RMS {rms:.4f} mm",
    )


def _enlarge_values(values: NDArray[np.float32]) -> tuple[NDArray[np.float32], float]:
    h, w = values.shape
    scale = max(1.0, MIN_SIDE_PX / max(h, w))
    if scale == 1.0:
        return values, scale
    size = (max(1, round(w * scale)), max(1, round(h * scale)))
    large = cv2.resize(values, size, interpolation=cv2.INTER_CUBIC)
    # the slopes of an interpolated surface show the pixel grid; a blur of half a pixel hides it
    # [px of the image] sigma
    return np.asarray(cv2.GaussianBlur(large, (0, 0), 0.6 * scale)), scale


def join_texts(words: Sequence[str]) -> str:
    """Return the texts that are not empty, separated by commas."""
    return ", ".join(part for part in words if part)
