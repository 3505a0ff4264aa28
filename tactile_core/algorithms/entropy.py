"""How uneven the displacement over a contact is: a warning of slip."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.errors import InputError

BIN_MM = 1 / 256
"""The papers' numbers fit this width; a fixed number of bins would stretch with the load."""

_ENOUGH_PIXELS = 30_000


def displacement_entropy(
    displacement_mm: Array, mask: Bool | None = None, *, bin_mm: float = BIN_MM
) -> float:
    """Return the entropy of the displacement's magnitude over the contact, in bits.

    −Σ p log2 p over a histogram of the magnitude with bins of a fixed width [Yuan 2015, section
    III-B]. It is small while the whole contact moves alike and grows when its border lags behind.
    Noise of 0.1 px in the markers alone gives about 1.5 bits.

    Parameters
    ----------
    displacement_mm : (H, W, 2) or (H, W)
        Of the skin, or its magnitude already.
    mask : (H, W) bool, optional
        The contact; by default the whole image.
    bin_mm : float
        Width of a bin.

    Returns
    -------
    float
        0 for an empty contact. Of a large one every second or third pixel of every second or third
        row is counted, which changes it by less than 0.02 bits.

    Raises
    ------
    InputError
        The shapes do not fit, or ``bin_mm`` is not positive.
    """
    shape = displacement_mm.shape
    if len(shape) not in (2, 3) or shape[2:] not in ((), (2,)) or 0 in shape:
        raise InputError(f"a displacement field is (H, W, 2) or (H, W); this one is {shape}")
    if mask is not None and mask.shape != shape[:2]:
        raise InputError(f"the field is {shape[:2]} and the mask {mask.shape}; they must agree")
    if not bin_mm > 0:
        raise InputError(f"bins of {bin_mm} mm are none; give a width above 0")
    counted = shape[0] * shape[1] if mask is None else int(np.count_nonzero(mask))
    if not counted:
        return 0.0
    step = max(1, int(np.sqrt(counted / _ENOUGH_PIXELS)))
    sampled = None if mask is None else np.ascontiguousarray(mask[::step, ::step])
    magnitude = _magnitude(displacement_mm[::step, ::step]) / np.float32(bin_mm)
    if sampled is not None:
        magnitude = magnitude[sampled]
    counts = np.bincount(magnitude.ravel().astype(np.int64))
    share = counts[counts > 0] / magnitude.size
    return float(max(0.0, -(share * np.log2(share)).sum()))


def _magnitude(field: Array) -> NDArray[np.float32]:
    if field.ndim == 2:
        return np.abs(np.asarray(field, np.float32))
    x, y = cv2.split(np.asarray(field, np.float32))
    return np.asarray(cv2.magnitude(x, y))
