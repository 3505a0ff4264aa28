"""Entropy of the displacement over a contact, an indicator of incipient slip."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.errors import InputError

# [mm] Width of a bin of the histogram. It is fixed: with a fixed number of bins the width
# would grow with the load, and the entropy with it less. Source: by hand, so that virtual
# grasps reach the entropy of the 2015 paper (``docs/building/slip_curves.py``).
BIN_MM = 1 / 256


def displacement_entropy(
    displacement_mm: Array, mask: Bool | None = None, *, bin_mm: float = BIN_MM
) -> float:
    """Return the entropy of the displacement's magnitude over the contact, in bits.

    It is −Σ p log2 p over a histogram of the magnitude [1]_, section III-B. It is small while the
    whole contact moves uniformly and grows when its border starts to slip. Marker noise of 0.1 px
    alone gives about 1.5 bits.

    Parameters
    ----------
    displacement_mm : (H, W, 2) or (H, W)
        Displacement of the gel surface, or its magnitude.
    mask : (H, W) bool, optional
        The contact area. Default: the whole image.
    bin_mm : float
        Width of a bin.

    Returns
    -------
    float
        0 for an empty contact. A large contact is subsampled, which changes the entropy by less
        than 0.02 bits.

    Raises
    ------
    InputError
        The shapes do not match, or ``bin_mm`` is not positive.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """
    shape = displacement_mm.shape
    if len(shape) not in (2, 3) or shape[2:] not in ((), (2,)) or 0 in shape:
        raise InputError(f"a displacement field is (H, W, 2) or (H, W); this one is {shape}")
    if mask is not None and mask.shape != shape[:2]:
        raise InputError(f"the field is {shape[:2]} and the mask {mask.shape}; they must agree")
    if not bin_mm > 0:
        raise InputError(f"a bin width of {bin_mm} mm is not positive; give a width above 0")
    counted = shape[0] * shape[1] if mask is None else int(np.count_nonzero(mask))
    if not counted:
        return 0.0
    # [pixels] The entropy changes by less than 0.02 bits
    step = max(1, int(np.sqrt(counted / 30_000)))
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
