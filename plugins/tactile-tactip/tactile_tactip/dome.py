"""A virtual dome: where its pins are while a plate presses it, and what the camera sees of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float64, UInt8
from tactile_core.interfaces.image import ImageSection

RADIUS_MM = 20.0
CAMERA_MM = 48.0  # From the lens to the tip
_RINGS = 6  # Rings of the hexagon around the middle pin: 127 pins
_PITCH_MM = 2.5  # Along the dome; the corners are then as far from the rim as in real images
_PIN_MM = 0.3  # Radius of a pin's white tip
_SOFT_MM = 0.5  # Depth over which the membrane bends at the border of the contact
_BULGE = 0.6  # What is pressed in moves outwards by this share, at a dome radius from the axis


@dataclass(frozen=True)
class Plate:
    """A plate that presses the dome.

    Attributes
    ----------
    depth_mm : float
        How far it is beyond first contact; negative where it does not touch.
    angle_deg : float
        Inclination, positive where the plate is closer to the camera on the right.
    shear_mm : (x, y)
        How far the plate then moved along the membrane.
    """

    depth_mm: float = -5.0
    angle_deg: float = 0.0
    shear_mm: tuple[float, float] = (0.0, 0.0)


def pins_at_rest() -> Float64:
    """(127, 3) pins of the undeformed dome, mm: x, y, and z from the tip away from the camera."""
    row, column = np.mgrid[-_RINGS : _RINGS + 1, -_RINGS : _RINGS + 1].reshape(2, -1)
    inside = np.abs(row + column) <= _RINGS
    along = _PITCH_MM * np.stack([column + row / 2, row * np.sqrt(0.75)], axis=1)[inside]
    arc = np.hypot(*along.T)
    polar = arc / RADIUS_MM
    # the sinc is the chord's projection over the arc, 1 at the tip
    across = along * np.sinc(polar / np.pi)[:, None]
    return np.column_stack([across, -RADIUS_MM * (1 - np.cos(polar))])


def pressed_pins(plate: Plate) -> Float64:
    """(127, 3) pins while a plate presses, mm.

    What is beyond the plate is pushed back to it along its normal, softly at the border; it bulges
    outwards, and sticks to the plate as that shears. This is no elastic model: it moves pins as
    smoothly and about as far as recorded ones.
    """
    rest = pins_at_rest()
    angle = np.deg2rad(plate.angle_deg)
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    # the plane touches the sphere where its normal meets it
    beyond = rest @ normal + RADIUS_MM * (normal[2] - 1) + plate.depth_mm
    pushed = _SOFT_MM * np.logaddexp(0, beyond / _SOFT_MM)
    touched = RADIUS_MM * normal[:2]
    outwards = _BULGE * pushed[:, None] * (rest[:, :2] - touched) / RADIUS_MM
    sticking = (pushed / (pushed + _SOFT_MM))[:, None]
    moved = rest - pushed[:, None] * normal
    moved[:, :2] += outwards + sticking * np.array(plate.shear_mm)
    return np.asarray(moved, np.float64)


def seen_px(pins_mm: Array, image: ImageSection) -> Float64:
    """(N, 2) pins in the image, x and y, through a pinhole."""
    focal_px = CAMERA_MM / image.mm_per_px
    middle = np.array([image.width_px - 1, image.height_px - 1]) / 2
    return np.asarray(middle + focal_px * pins_mm[:, :2] / (CAMERA_MM + pins_mm[:, 2:]))


def picture(pins_mm: Array, image: ImageSection, *, number: int, seed: int = 0) -> UInt8:
    """(H, W) image of white pins in a dark dome under uneven light, with noise.

    Parameters
    ----------
    pins_mm : (N, 3) float
    image : ImageSection
    number, seed : int
        The same numbers give the same noise; the seed selects the unit, and with it the light.
    """
    y, x = np.mgrid[: image.height_px, : image.width_px].astype(np.float32)
    unit = np.random.default_rng([seed, 0])
    tilt = unit.uniform(-0.3, 0.3, 2)  # [share of the light] from side to side
    light = 1 + tilt[0] * (x / image.width_px - 0.5) + tilt[1] * (y / image.height_px - 0.5)
    white = np.zeros(x.shape, np.float32)
    places = seen_px(pins_mm, image)
    radii = _PIN_MM / image.mm_per_px * CAMERA_MM / (CAMERA_MM + pins_mm[:, 2])
    reach = int(np.ceil(radii.max())) + 2
    for (px, py), radius in zip(places, radii, strict=True):
        column, row = round(px), round(py)
        rows = slice(max(row - reach, 0), max(row + reach + 1, 0))
        columns = slice(max(column - reach, 0), max(column + reach + 1, 0))
        away = np.hypot(x[rows, columns] - px, y[rows, columns] - py)
        tip = np.clip(radius + 0.5 - away, 0, 1)
        white[rows, columns] = np.maximum(white[rows, columns], tip)
    # grey levels of the dark membrane, and of the white of the pins above it
    shown = light * (14 + 180 * white)
    noise = np.random.default_rng([seed, number + 1]).normal(0, 3, x.shape)  # grey levels
    return np.asarray(np.clip(np.rint(shown + noise), 0, 255), np.uint8)
