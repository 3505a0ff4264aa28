"""The same equations where some slopes are wrong: a misfit counts by its size, not its square."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_core.algorithms.poisson.integration import PoissonSolver
from tactile_core.algorithms.poisson.laplacian import laplacian
from tactile_core.errors import InputError

_STEP_SLOPE = 0.2
"""How much of a misfit one round explains away: decides how fast the rounds converge, not where."""

_FILLED_WEIGHT = 0.1
"""What was filled in shapes the height only where no measured slope contradicts."""


def integrate_robustly(
    gx: Array,
    gy: Array,
    *,
    mm_per_px: float,
    valid: Bool | None = None,
    outlier_slope: float = 0.02,
    rounds: int = 8,
    compiled: bool = False,
) -> Float32:
    """Height that a few wrong slopes do not bend.

    As in :func:`~tactile_core.algorithms.poisson.integrate` with a free border, neighbours should
    differ by the mean of their slopes. Here Huber's function of the misfits is smallest: their
    squares up to ``outlier_slope``, their size beyond it, so that an outlier, the rim of a shadow
    or a highlight pulls no harder than a misfit of ``outlier_slope``. The problem is convex; the
    alternating direction method of multipliers (Boyd et al. 2011; as "split Bregman", Goldstein
    and Osher 2009) turns it into rounds of clipped misfits and one exact solution each. Where
    every misfit is below ``outlier_slope`` and every slope valid, the result is that of
    ``integrate``.

    Slopes that are wrong and yet those of some surface (too shallow all around a ball, say)
    contradict nothing, and no integration finds them.

    Parameters
    ----------
    gx, gy : (H, W)
        ∂z/∂x and ∂z/∂y, dimensionless.
    mm_per_px : float
        Distance of neighbouring pixels.
    valid : (H, W) bool, optional
        False where a slope was filled in: there it counts a tenth.
    outlier_slope : float
        Misfit between a slope and the surface from which on it is an outlier: about the error of
        a good slope, 0.02 for 1°. Far below that error the noise of good slopes is no longer
        averaged; 0 makes all of them outliers: the sum of the misfits' sizes (L1).
    rounds : int
        Each takes as long as ``integrate``, or a little longer.
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.

    Returns
    -------
    (H, W) float32
        Height in mm, mean 0.

    Raises
    ------
    InputError
        Shapes differ or are not 2-D, a slope is not finite, or the scale is not positive.
    """
    gx, gy = np.asarray(gx), np.asarray(gy)
    height = PoissonSolver(gx.shape, mm_per_px=mm_per_px, compiled=compiled).solve(gx, gy)
    if valid is not None and valid.shape != height.shape:
        raise InputError(f"valid is {valid.shape} where the slopes are {height.shape}")
    inverse = laplacian(height.shape, "neumann", np.float32, compiled=compiled)
    rise = _at_faces(gx, gy) * np.float32(mm_per_px)
    weight = None if valid is None or valid.all() else _weights(valid)
    most = np.float32(_STEP_SLOPE * mm_per_px)
    gain = np.float32(_STEP_SLOPE / (_STEP_SLOPE + outlier_slope))
    # pull: the multipliers, what each face has pulled with so far
    pull, misfit = np.zeros_like(rise), np.zeros_like(rise)
    for _ in range(rounds):
        np.subtract(height[:, 1:], height[:, :-1], out=misfit[0, :, :-1])
        np.subtract(height[1:], height[:-1], out=misfit[1, :-1])
        misfit -= rise
        misfit += pull
        misfit *= gain
        new_pull = np.clip(misfit, -most, most, out=misfit)
        if weight is not None:
            new_pull *= weight
        pull -= new_pull
        pull -= new_pull
        height += inverse.solve(_divergence(pull))
        pull, misfit = new_pull, pull
    return height


def _at_faces(gx: Array, gy: Array) -> Float32:
    """(2, H, W) means at the face to the right and the face below; 0 where there is none."""
    faces = np.zeros((2, *gx.shape), np.float32)
    faces[0, :, :-1] = 0.5 * (gx[:, 1:] + gx[:, :-1])
    faces[1, :-1] = 0.5 * (gy[1:] + gy[:-1])
    return faces


def _weights(valid: Bool) -> Float32:
    """(2, H, W) weight of each face; one beside a filled pixel counts as filled."""
    sure = np.where(valid, np.float32(1), np.float32(_FILLED_WEIGHT))
    faces = np.ones((2, *valid.shape), np.float32)
    np.minimum(sure[:, 1:], sure[:, :-1], out=faces[0, :, :-1])
    np.minimum(sure[1:], sure[:-1], out=faces[1, :-1])
    return faces


def _divergence(flow: Float32) -> Float32:
    """(H, W) what flows out of each pixel through its faces, less what flows in."""
    total: Float32 = flow[0] + flow[1]
    total[:, 1:] -= flow[0, :, :-1]
    total[1:] -= flow[1, :-1]
    return total
