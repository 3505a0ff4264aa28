"""Images of an object's imprint on a gel with markers; object and gel move independently."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

ROWS, COLUMNS = 240, 320
MARKER_PX, PITCH_PX = 9.0, 32
MARKERS = np.stack(
    np.meshgrid(np.arange(16.0, COLUMNS, PITCH_PX), np.arange(16.0, ROWS, PITCH_PX)), axis=-1
).reshape(-1, 2)
Y, X = np.mgrid[:ROWS, :COLUMNS].astype(np.float32)
CENTRE = 160.0, 120.0


def texture() -> NDArray[np.float32]:
    """(ROWS, COLUMNS, 3) relative change of intensity that the object's texture causes."""
    rng = np.random.default_rng(3)
    fine = cv2.GaussianBlur(rng.normal(size=(ROWS, COLUMNS, 3)), (0, 0), 5)
    within = np.exp(-(((X - CENTRE[0]) / 70) ** 4) - ((Y - CENTRE[1]) / 60) ** 4)
    return np.asarray(0.12 * fine / fine.std() * within[..., None], np.float32)


TEXTURE = texture()


def scene(
    object_px: tuple[float, float] = (0, 0),
    *,
    turn_deg: float = 0.0,
    surface_px: tuple[float, float] = (0, 0),
    depth: float = 1.0,
    light: float = 1.0,
    noise: float = 0.0,
    seed: int = 0,
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Render the imprint at the object's pose, and markers at the gel surface's position."""
    pose = cv2.getRotationMatrix2D(CENTRE, -turn_deg, 1.0)
    pose[:, 2] += object_px
    printed = depth * cv2.warpAffine(TEXTURE, pose, (COLUMNS, ROWS))
    markers_px = MARKERS + np.array(surface_px)
    image = (140 + 0.1 * X[..., None]) * (1 + printed)
    x, y = X - surface_px[0] - MARKERS[0, 0], Y - surface_px[1] - MARKERS[0, 1]
    from_marker = np.hypot(*((side + PITCH_PX / 2) % PITCH_PX - PITCH_PX / 2 for side in (x, y)))
    image *= 1 - 0.8 * np.clip(MARKER_PX / 2 + 0.5 - from_marker, 0, 1)[..., None]
    image = light * image + np.random.default_rng(seed).normal(0, noise, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), markers_px
