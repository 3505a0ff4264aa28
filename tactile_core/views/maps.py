"""Maps of measurements: colours over the image, a scale, a colour bar, and what lies over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.quantities.layers import Outline, Points, ScalarMap, Surface, VectorMap
from tactile_core.views import overlay
from tactile_core.views.drawing import Rgb
from tactile_core.views.shading import colours, painted, shaded, signed
from tactile_core.views.sheet import SMALLEST_PX, framed

_ENLARGED_BLUR_PX = 0.6


@dataclass(frozen=True)
class Over:
    """What is drawn over a map.

    Attributes
    ----------
    outlines : sequence of Outline
    points : sequence of Points
    vectors : VectorMap or None
        Arrows on a grid, where there are no points with arrows of their own.
    """

    outlines: Sequence[Outline] = ()
    points: Sequence[Points] = ()
    vectors: VectorMap | None = None

    def draw(self, picture: Rgb, *, mm_per_px: float, scale: float) -> str:
        """Draw it; return how arrows are enlarged."""
        for region in self.outlines:
            overlay.outline(picture, region)
        words = [
            overlay.points(picture, at, mm_per_px=mm_per_px, scale=scale) for at in self.points
        ]
        if self.vectors is not None and not any(at.from_px is not None for at in self.points):
            words.append(overlay.vectors(picture, self.vectors, mm_per_px=mm_per_px, scale=scale))
        return listed(words)

    def facts(self, mm_per_px: float) -> list[str]:
        """The area of each region."""
        areas = [(r.title, np.count_nonzero(r.mask) * mm_per_px**2) for r in self.outlines]
        return [f"{title} {area:.2f} mm²" for title, area in areas]


def relief(
    height: Surface,
    over: Over | None = None,
    *,
    title: str = "",
    span_mm: tuple[float, float] | None = None,
) -> Rgb:
    """Draw a height map as shaded relief with a scale bar and a colour bar in mm.

    The larger side is at least 640 px, so that small sensors' words are legible too. Noise is not
    stretched over all colours: the bar spans at least the size of one pixel on the gel.

    Parameters
    ----------
    height : Surface
        All zero gives an even surface.
    over : Over, optional
        Drawn over it.
    title : str
        Begins the line above the picture, e.g. the name of the observation.
    span_mm : (lowest, highest), optional
        Heights of the first and the last colour, the same for pictures that are to be compared.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    over = over or Over()
    surface, scale = _enlarged(height.mm)
    low, high = span_mm or (min(0.0, float(height.mm.min())), float(height.mm.max()))
    high = max(high, low + height.mm_per_px)
    picture = shaded(surface, height.mm_per_px / scale, low, high)
    arrows = over.draw(picture, mm_per_px=height.mm_per_px, scale=scale)
    highest = f"max {float(height.mm.max()):.3f} mm"
    return framed(
        picture,
        mm_per_px=height.mm_per_px / scale,
        bar=colours(picture.shape[0]),
        span=(low, high),
        title=title,
        facts=listed([highest, *over.facts(height.mm_per_px), arrows]),
    )


def magnitude(field: VectorMap, over: Over, mm_per_px: float, *, title: str = "") -> Rgb:
    """Draw a field of vectors as a map of the magnitude, with arrows for the direction.

    Where the field is not valid the map is paler. In mm, the bar spans at least the size of one
    pixel on the gel.

    Parameters
    ----------
    field : VectorMap
    over : Over
        Drawn over it. Arrows stand at its points, else on a grid.
    mm_per_px : float
    title : str
        Begins the line above the picture.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B, as large as the :func:`relief` of the same image.
    """
    size = np.hypot(field.values[..., 0], field.values[..., 1])
    surface, scale = _enlarged(size)
    least = mm_per_px if field.unit == "mm" else np.finfo(np.float32).tiny
    high = max(float(size.max()), float(least))
    picture = painted(surface / np.float32(high))
    if field.valid is not None:
        sure = cv2.resize(field.valid.view(np.uint8), surface.shape[::-1])[..., None] > 0
        picture = np.where(sure, picture, picture // 2 + 127).astype(np.uint8)
    arrows = Over(over.outlines, over.points, field).draw(picture, mm_per_px=mm_per_px, scale=scale)
    return framed(
        picture,
        mm_per_px=mm_per_px / scale,
        bar=colours(picture.shape[0]),
        span=(0.0, high),
        unit=field.unit,
        title=title,
        facts=listed([f"max {size.max():.3f} {field.unit}".rstrip(), arrows]),
    )


def coloured(field: ScalarMap, over: Over, mm_per_px: float, *, title: str = "") -> Rgb:
    """Draw a number for each pixel as a colour, beside a bar from the smallest to the largest.

    Parameters
    ----------
    field : ScalarMap
    over : Over
        Drawn over it.
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
    surface, scale = _enlarged(values)
    picture = painted((surface - np.float32(low)) / np.float32(high - low))
    arrows = over.draw(picture, mm_per_px=mm_per_px, scale=scale)
    return framed(
        picture,
        mm_per_px=mm_per_px / scale,
        bar=colours(picture.shape[0]),
        span=(low, high),
        unit=field.unit,
        title=title,
        facts=listed([f"{low:.4g} to {high:.4g} {field.unit}".rstrip(), arrows]),
    )


def deviation(measured: Surface, truth: Surface, *, most_mm: float, title: str = "") -> Rgb:
    """Draw measured less true height: red where too high, blue where too low, white where right.

    Parameters
    ----------
    measured, truth : Surface
        Of one size and scale.
    most_mm : float
        Deviation that gets the strongest colour; the same for pictures that are to be compared.
    title : str
        Begins the line above the picture.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B, as large as the :func:`relief` of the same map.
    """
    error_mm = measured.mm - truth.mm
    most = max(most_mm, 1e-6)
    surface, scale = _enlarged(error_mm)
    rms = float(np.sqrt(np.mean(np.square(error_mm))))
    picture = signed(surface / np.float32(most))
    return framed(
        picture,
        mm_per_px=measured.mm_per_px / scale,
        bar=signed(np.linspace(-1, 1, picture.shape[0], dtype=np.float32)),
        span=(-most, most),
        title=title,
        facts=f"RMS {rms:.4f} mm",
    )


def _enlarged(values: NDArray[np.float32]) -> tuple[NDArray[np.float32], float]:
    h, w = values.shape
    scale = max(1.0, SMALLEST_PX / max(h, w))
    if scale == 1.0:
        return values, scale
    size = (max(1, round(w * scale)), max(1, round(h * scale)))
    large = cv2.resize(values, size, interpolation=cv2.INTER_CUBIC)
    # the slopes of an interpolated surface show the pixels' grid; half a pixel of blur hides it
    return np.asarray(cv2.GaussianBlur(large, (0, 0), _ENLARGED_BLUR_PX * scale)), scale


def listed(words: Sequence[str]) -> str:
    """Return the words that are not empty, as a list."""
    return ", ".join(part for part in words if part)
