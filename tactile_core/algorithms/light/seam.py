"""Seams: lines at which a transfer has joined parts of an image that do not belong together."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter

from tactile_core.algorithms.arrays.types import Array

# [lines] Steps between lines are compared with those at this distance: blocks and halved colours of
# compressed images repeat within it
REACH = 16

# [intensity of 8 bits] Steps below the rounding of whole numbers say nothing.
LEAST_STEP = 0.3


def find_seam(change: Array) -> tuple[int, float]:
    """Return the row where a seam is most likely to begin, and how distinct it is.

    A gel is smooth, so that most of what touches it changes the image over several rows; between
    two rows of one image there are noise and texture, alike in all rows. Of real objects, only the
    edge of a plate in line with the rows looks like a seam.

    Parameters
    ----------
    change : (H, W, K) float32
        Change of the intensity against a reference, in levels of 8 bits.

    Returns
    -------
    int, float
        The first row below the seam, and the ratio of the mean absolute step to it and the largest
        such step within :data:`REACH` rows: about 1 without a seam, and 0 for an image too small to
        have any around.
    """
    if len(change) <= 2 * REACH:
        return 0, 0.0
    steps = np.abs(np.diff(change, axis=0)).mean(axis=(1, 2))
    others = np.arange(-REACH, REACH + 1) != 0
    around = maximum_filter(steps, footprint=others, mode="constant")
    ratios = steps / np.maximum(around, LEAST_STEP)
    row = int(ratios.argmax())
    return row + 1, float(ratios[row])
