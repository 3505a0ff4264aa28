"""Pictures of measurements, made to be looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.quantities import ContactMask, DisplacementField, Frame, HeightMap, MarkerField
from tactile_core.views.drawing import Rgb, blank, text_size, write
from tactile_core.views.overlay import drag, outline
from tactile_core.views.shading import colours, painted, shaded, signed
from tactile_core.views.sheet import FOOT, GAP, SMALLEST_PX, framed

_ENLARGED_BLUR_PX = 0.6
_DIMMED = 0.55


def relief(
    height: HeightMap,
    contact: ContactMask | None,
    *,
    markers: MarkerField | None = None,
    field: DisplacementField | None = None,
    title: str = "",
    span_mm: tuple[float, float] | None = None,
) -> Rgb:
    """Draw a height map as shaded relief with a scale bar, a colour bar in mm and the contact.

    The larger side is at least 640 px, so that small sensors' words are legible too. Noise is not
    stretched over all colours: the bar spans at least the size of one pixel on the gel.

    Parameters
    ----------
    height : HeightMap
        Finite; all zero gives an even surface.
    contact : ContactMask or None
        Outlined where given.
    markers, field : MarkerField or DisplacementField, optional
        How the skin is dragged, as arrows; marks that are not seen are hollow.
    title : str
        Begins the line above the picture, e.g. the name of the observation.
    span_mm : (lowest, highest), optional
        Heights of the first and the last colour, the same for pictures that are to be compared.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    surface, scale = _enlarged(height)
    low, high = span_mm or (min(0.0, float(height.mm.min())), float(height.mm.max()))
    high = max(high, low + height.mm_per_px)
    picture = shaded(surface, height.mm_per_px / scale, low, high)
    if contact is not None:
        outline(picture, contact)
    magnified = drag(picture, markers, field, scale=scale)
    return framed(
        picture,
        mm_per_px=height.mm_per_px / scale,
        bar=colours(picture.shape[0]),
        span_mm=(low, high),
        title=title,
        facts=", ".join(part for part in (_facts(height, contact), magnified) if part),
    )


def dragged(
    field: DisplacementField,
    contact: ContactMask | None = None,
    *,
    markers: MarkerField | None = None,
    title: str = "",
) -> Rgb:
    """Draw how far the skin is dragged as a map of the magnitude, with arrows for the direction.

    Where the field is not valid the map is paler. The bar spans at least the size of one pixel on
    the gel.

    Parameters
    ----------
    field : DisplacementField
        Finite.
    contact : ContactMask, optional
        Outlined where given.
    markers : MarkerField, optional
        Arrows stand at the marks, else on a grid.
    title : str
        Begins the line above the picture.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B, as large as the :func:`relief` of the same image.
    """
    size = HeightMap(np.hypot(field.mm[..., 0], field.mm[..., 1]), field.valid, field.mm_per_px)
    surface, scale = _enlarged(size)
    high = max(float(size.mm.max()), field.mm_per_px)
    picture = painted(surface / np.float32(high))
    sure = cv2.resize(field.valid.view(np.uint8), surface.shape[::-1])[..., None] > 0
    picture = np.where(sure, picture, picture // 2 + 127).astype(np.uint8)
    if contact is not None:
        outline(picture, contact)
    magnified = drag(picture, markers, field, scale=scale)
    return framed(
        picture,
        mm_per_px=field.mm_per_px / scale,
        bar=colours(picture.shape[0]),
        span_mm=(0.0, high),
        title=title,
        facts=", ".join(part for part in (f"max {size.mm.max():.3f} mm", magnified) if part),
    )


def marked(frame: Frame, markers: MarkerField, *, title: str = "") -> Rgb:
    """Draw the marks and where they went over the frame that shows them.

    Parameters
    ----------
    frame : Frame
        Of any number of channels.
    markers : MarkerField
        Those that are not seen are hollow.
    title : str
        Written beneath, e.g. the name of the observation.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    seen = frame.pixels[..., :3] if frame.pixels.shape[2] >= 3 else frame.pixels[..., :1]
    light = np.clip(seen.astype(np.float32) * (255 / frame.full_scale), 0, 255)
    shown = np.broadcast_to(_DIMMED * light, (*light.shape[:2], 3)) + 255 * (1 - _DIMMED) / 2
    height, width = light.shape[:2]
    scale = max(1.0, SMALLEST_PX / max(height, width))
    large = round(width * scale), round(height * scale)
    picture = cv2.resize(shown.astype(np.uint8), large, interpolation=cv2.INTER_LINEAR)
    magnified = drag(np.asarray(picture), markers, None, scale=scale)
    words = f"{int(markers.seen.sum())} of {len(markers.ids)} marks seen"
    return side_by_side(
        [np.asarray(picture, np.uint8)],
        [", ".join(part for part in (title, words, magnified) if part)],
    )


def deviation(measured: HeightMap, truth: HeightMap, *, most_mm: float, title: str = "") -> Rgb:
    """Draw measured less true height: red where too high, blue where too low, white where right.

    Parameters
    ----------
    measured, truth : HeightMap
        Finite, of one size and scale.
    most_mm : float
        Deviation that gets the strongest colour; the same for pictures that are to be compared.
    title : str
        Begins the line above the picture.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B, as large as the :func:`relief` of the same map.
    """
    error = replace(measured, mm=measured.mm - truth.mm)
    most = max(most_mm, 1e-6)
    surface, scale = _enlarged(error)
    rms = float(np.sqrt(np.mean(np.square(error.mm))))
    picture = signed(surface / np.float32(most))
    return framed(
        picture,
        mm_per_px=error.mm_per_px / scale,
        bar=signed(np.linspace(-1, 1, picture.shape[0], dtype=np.float32)),
        span_mm=(-most, most),
        title=title,
        facts=f"RMS {rms:.4f} mm",
    )


def side_by_side(images: Sequence[Rgb], captions: Sequence[str]) -> Rgb:
    """Put pictures in a row, each with its caption beneath.

    Parameters
    ----------
    images : sequence of (H, W, 3) uint8
        R, G, B; made equally high, that of the highest.
    captions : sequence of str
        As many; may be empty strings.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    high = max(image.shape[0] for image in images)
    unit = max(1.0, high / SMALLEST_PX)
    gap, foot = round(GAP * unit), round(FOOT * unit)
    fitted = [_of_height(image, high) for image in images]
    wide = [
        max(image.shape[1], text_size(caption, unit)[0])
        for image, caption in zip(fitted, captions, strict=True)
    ]
    sheet = blank(gap + high + foot, sum(wide) + gap * (len(wide) + 1))
    left = gap
    for image, caption, width in zip(fitted, captions, wide, strict=True):
        sheet[gap : gap + high, left : left + image.shape[1]] = image
        write(sheet, caption, (left, gap + high + 0.6 * foot), unit)
        left += width + gap
    return sheet


def _enlarged(height: HeightMap) -> tuple[NDArray[np.float32], float]:
    h, w = height.mm.shape
    scale = max(1.0, SMALLEST_PX / max(h, w))
    if scale == 1.0:
        return height.mm, scale
    size = (max(1, round(w * scale)), max(1, round(h * scale)))
    large = cv2.resize(height.mm, size, interpolation=cv2.INTER_CUBIC)
    # the slopes of an interpolated surface show the pixels' grid; half a pixel of blur hides it
    return np.asarray(cv2.GaussianBlur(large, (0, 0), _ENLARGED_BLUR_PX * scale)), scale


def _of_height(image: Rgb, height_px: int) -> Rgb:
    h, w = image.shape[:2]
    if h == height_px:
        return image
    size = (max(1, round(w * height_px / h)), height_px)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR), np.uint8)


def _facts(height: HeightMap, contact: ContactMask | None) -> str:
    facts = [f"max {float(height.mm.max()):.3f} mm"]
    if contact is not None:
        facts.append(f"contact {contact.area_mm2:.2f} mm²")
    return ", ".join(facts)
