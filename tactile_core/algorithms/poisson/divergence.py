"""Divergence of the slopes on the faces between pixels."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.algorithms.poisson.laplacian import Boundary


def double_divergence(gx: Array, gy: Array, boundary: Boundary) -> Array:
    """Twice the divergence of the slopes at the faces between pixels.

    The slope at a face is the mean of its two pixels. At the border, "neumann" has no face;
    "dirichlet" has one towards the pixel outside, whose slope extrapolates the last two linearly.

    Parameters
    ----------
    gx, gy : (H, W)
        ∂z/∂x and ∂z/∂y, C-contiguous and of one floating dtype.
    boundary : "neumann" or "dirichlet"
        Condition at the border of the image.

    Returns
    -------
    (H, W) array
        A new array.
    """
    across = np.empty_like(gx)
    flat = gx.reshape(-1)
    if flat.size > 2:
        # the difference of the flat array is wrong at the ends of rows, which are set below; it
        # takes a quarter of the time of a difference over slices of rows
        np.subtract(flat[2:], flat[:-2], out=across.reshape(-1)[1:-1])
    across[:, 0], across[:, -1] = _ends(gx.T, boundary)
    down = np.empty_like(gy)
    np.subtract(gy[2:], gy[:-2], out=down[1:-1])
    down[0], down[-1] = _ends(gy, boundary)
    across += down
    return across


def _ends(slopes: Array, boundary: Boundary) -> tuple[Array, Array]:
    """Twice the divergence along the first axis, in the first and last line."""
    if len(slopes) == 1:
        nothing = np.zeros_like(slopes[0])
        return nothing, nothing
    first, second, penultimate, last = slopes[0], slopes[1], slopes[-2], slopes[-1]
    if boundary == "dirichlet":
        return 2 * (second - first), 2 * (last - penultimate)
    return first + second, -(penultimate + last)


# Filter along a slope. Its mean over two neighbours is then the mean slope between them.
ALONG = np.array([-1, 14, -1], np.float32) / 12

ALONG_MEANS = np.array([0.0213, -0.1998, 1.357, -0.1998, 0.0213], np.float32)
# Filters along and across slopes that are means over 2 × 2 smaller cells.
ACROSS_MEANS = np.array([-1, 34, -1], np.float32) / 32


def between_cells(gx: Float32, gy: Float32, *, averaged: bool = False) -> tuple[Float32, Float32]:
    """Return slopes whose means over neighbours are the mean slopes between these neighbours.

    :func:`double_divergence` takes the mean of two slopes for the mean slope between them, which
    is exact to the second order. That of g − δ²g / 12 is exact to the fourth [1]_: a wave with a
    period of eight cells then loses 0.6 % of its height instead of 5 %. Means over 2 × 2 smaller
    cells are sharpened, too, and by two differences, exact to the sixth order: a wave with a period
    of six cells loses 0.5 %, and one of four 5 %.

    Parameters
    ----------
    gx, gy : (h, w) float32
        Slopes at the centres of cells.
    averaged : bool
        Whether they are means of the slopes at the centres of four smaller cells.

    References
    ----------
    .. [1] P. J. Davis and P. Rabinowitz, "Methods of Numerical Integration", Academic Press, 1984,
       section 2.9 (end corrections of the trapezoidal rule).
    """
    along, across = (ALONG_MEANS, ACROSS_MEANS) if averaged else (ALONG, np.ones(1, np.float32))
    x = cv2.sepFilter2D(gx, -1, along, across, borderType=cv2.BORDER_REPLICATE)
    y = cv2.sepFilter2D(gy, -1, across, along, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(x, np.float32), np.asarray(y, np.float32)
