"""Motion of the points of a contact since its load settled, and what it shows of slip."""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Complex64, Float32, Intp
from tactile_core.algorithms.entropy import displacement_entropy
from tactile_core.algorithms.slip.plane import positions_mm, since, since_at, strain
from tactile_core.algorithms.slip.stick_region import (
    STICK_REGION,
    StickRegion,
    calm_weights,
    far_weights,
    stick_region,
)


class ContactMotion(NamedTuple):
    """Motion of points of a contact.

    Attributes
    ----------
    points : (n,) intp
        Flat indices.
    displacement : (n,) complex64
        Of each point, x + iy in mm.
    weight : (n,) float32
        Large for points that probably stick: :func:`calm_weights`.
    entropy_bits : float
        Entropy of the magnitude of the displacement in the whole contact.
    region : StickRegion
        The rigid motion of the points that stick.
    """

    points: Intp
    displacement: Complex64
    weight: Float32
    entropy_bits: float
    region: StickRegion


def contact_motion(
    now: Complex64,
    before: Complex64,
    spacing_mm: float,
    mask: Bool,
    every: int = 1,
    *,
    noise_mm: float = STICK_REGION.noise_mm,
) -> ContactMotion:
    """Return the motion since the load settled.

    Parameters
    ----------
    now, before : (h, w) complex64
        See :func:`since`.
    spacing_mm : float
        Distance between neighbouring grid points.
    mask : (h, w) bool
        The contact area; not empty.
    every : int
        Distance of the points in the list of all points of the contact, row by row.
    noise_mm : float
        Noise of a displacement.
    """
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
    # with a rim, so that the strain is that of the whole field
    window = slice(max(top - 1, 0), top + height + 1), slice(max(left - 1, 0), left + width + 1)
    moved, inside = since(now, before, spacing_mm, window=window), mask[window]
    chosen = inside.ravel().nonzero()[0][::every]
    displacement = moved.ravel()[chosen]
    weight = calm_weights(displacement, strain(moved, spacing_mm, chosen))
    points = mask.ravel().nonzero()[0][::every]
    position = positions_mm(mask.shape, spacing_mm).ravel()[points]
    entropy_bits = displacement_entropy(np.abs(moved), inside)
    region = stick_region(displacement, position, weight, noise_mm)
    return ContactMotion(points, displacement, weight, entropy_bits, region)


def recent_motion(
    now: Complex64,
    before: Complex64,
    spacing_mm: float,
    points: Intp,
    weight: NDArray[Any],
) -> tuple[Complex64, NDArray[Any]]:
    """Return the motion of points of the contact since a recent field, and initial weights.

    Parameters
    ----------
    now, before : (h, w) complex64
        See :func:`since`.
    spacing_mm : float
        Distance between neighbouring grid points.
    points : (n,) intp
        Flat indices.
    weight : (n,)
        Of the stick region of a longer motion.

    Returns
    -------
    displacement : (n,) complex64
    weight : (n,)
        Small for points that lag behind in either motion.
    """
    moved = since_at(now, before, spacing_mm, points)
    return moved, weight * far_weights(moved)
