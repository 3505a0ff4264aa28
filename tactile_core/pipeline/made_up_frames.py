"""Frames that no camera took: measuring them loads and compiles code before the first real one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tactile_core.formats.video import NOMINAL_FPS
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import Float32, Frame, Reference

# [px] How far the discs have moved along x in each frame; None without discs: the contact moves, so
# that trackers and slip steps measure
_MOVES_PX: tuple[int | None, ...] = (None, 0, 2, None)
# [share of the full scale] Intensity of the undeformed surface, if there is no reference
_LEVEL = 0.5


def made_up_frames(reference: Reference, mm_per_px: float) -> Iterator[Frame]:
    """Yield frames of an undeformed surface, and of discs that move on it.

    Which way the lights come from need not be known: each disc is shaded as if its lights came from
    other sides, and for one of them that is true, so that it looks like a ball.
    """
    moves = [(moved_px, turn) for turn in (1, -1) for moved_px in _MOVES_PX]
    for number, (moved_px, turn) in enumerate(moves):
        pixels = reference.pixels
        if moved_px is not None:
            pixels = np.minimum(_press_discs(pixels, moved_px, turn), reference.full_scale)
        shown = Reference(pixels, reference.channels, reference.full_scale)
        yield replace(shown.as_frame(mm_per_px), sequence=number, timestamp_s=number / NOMINAL_FPS)


def made_up_reference(image: ImageSection, channels: tuple[str, ...]) -> Reference:
    """Return an even undeformed surface with dark markers."""
    height, width = image.height_px, image.width_px
    pitch_px = width / 12  # [count] along x: shipped gels have 9 to 20
    y, x = np.indices((height, width))
    away = np.hypot(*((at % pitch_px - pitch_px / 2) for at in (x, y)))
    full_scale = float((1 << image.bit_depth) - 1)
    # Of the markers, and of the rest, in shares of the level
    level = np.where(away < pitch_px / 5, 0.3, 1.0) * _LEVEL * full_scale
    pixels = np.repeat(level[..., None], len(channels), axis=-1).astype(np.float32)
    return Reference(pixels, channels, full_scale)


def _press_discs(pixels: Float32, moved_px: int, turn: int) -> Float32:
    """Shade four discs, each channel from another side, and move them along x.

    The sides of the channels follow each other clockwise or, with ``turn`` -1, the other way. From
    disc to disc all are turned by a right angle.
    """
    height, width, count = pixels.shape
    radius_px = 0.2 * height  # [heights] a fingertip's usual contacts
    y, x = np.indices((height, width), dtype=np.float32)
    shaded = np.roll(pixels, moved_px, axis=1)
    pressed = pixels.astype(np.float32)
    for corner in range(4):
        middle = width * (1 + 2 * (corner % 2)) / 4 + moved_px, height * (1 + corner // 2 * 2) / 4
        right, down = (x - middle[0]) / radius_px, (y - middle[1]) / radius_px
        angle = turn * 2 * np.pi * np.arange(count) / count + corner * np.pi / 2
        slope = right[..., None] * np.cos(angle) + down[..., None] * np.sin(angle)
        inside = (right**2 + down**2 < 1)[..., None]
        # [relative] Change of intensity at its border: large enough for a contact
        pressed = np.where(inside, shaded * (1 + 0.4 * slope), pressed)
    return pressed.astype(np.float32)
