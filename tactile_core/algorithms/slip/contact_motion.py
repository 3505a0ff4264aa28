"""Motion of the points of a contact since its load settled, and what it shows of slip."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.types import Bool, Complex64, Float32
from tactile_core.algorithms.entropy import ENTROPY, displacement_entropy
from tactile_core.algorithms.slip.plane import parts, since, strain
from tactile_core.algorithms.slip.stick_region import STICK_REGION, calm_weights

_CALM = (
    STICK_REGION.calm_quantile,
    STICK_REGION.calm_strains,
    STICK_REGION.min_strain,
    STICK_REGION.distance_power,
)
_BIN_MM = np.float32(ENTROPY.bin_mm)
"""Parameters of the compiled loops."""


class ContactMotion(NamedTuple):
    """Motion of points of a contact.

    Attributes
    ----------
    displacement : (n,) complex64
        Of each point, x + iy in mm.
    weight : (n,) float32
        Large for points that probably stick: :func:`calm_weights`.
    entropy_bits : float
        Entropy of the magnitude of the displacement in the whole contact.
    """

    displacement: Complex64
    weight: Float32
    entropy_bits: float


def contact_motion(
    now: Complex64,
    before: Complex64,
    spacing_mm: float,
    mask: Bool,
    every: int = 1,
    *,
    compiled: bool = False,
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
    compiled : bool
        Whether to use the compiled loop if it is available.
    """
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
    # with a rim, so that the strain is that of the whole field
    window = slice(max(top - 1, 0), top + height + 1), slice(max(left - 1, 0), left + width + 1)
    moved, mask = since(now, before, spacing_mm, window=window), mask[window]
    chosen = np.flatnonzero(mask)[::every]
    displacement = moved.ravel()[chosen]
    loops = kernels.chosen(compiled)
    if loops is None:
        weight = calm_weights(displacement, strain(moved, spacing_mm, chosen))
        return ContactMotion(displacement, weight, displacement_entropy(np.abs(moved), mask))
    per_point = np.float32(1 / spacing_mm)
    found = loops.calm_and_entropy(parts(moved), mask, chosen, per_point, _CALM, _BIN_MM)
    return ContactMotion(displacement, *found)
