"""Robust integration: outliers among the slopes count by their size instead of their square."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_core.algorithms.poisson.integration import integrate, solve_poisson
from tactile_core.errors import InputError

# [slope] Step of the multipliers. It decides how fast the rounds converge, not to which height
_STEP_SLOPE = 0.2


def integrate_robustly(
    gx: Array,
    gy: Array,
    *,
    mm_per_px: float,
    valid: Bool | None = None,
    outlier_slope: float = 0.02,
    rounds: int = 8,
) -> Float32:
    """Integrate slopes robustly against a few outliers.

    As in :func:`~tactile_core.algorithms.poisson.integrate` with a free border, neighbours should
    differ by the mean of their slopes. Here the sum of Huber's function [1]_ of the residuals is
    minimised: squares up to ``outlier_slope``, sizes beyond it. So an outlier, such as the rim of a
    shadow or a highlight, has no more influence than a residual of ``outlier_slope``. The problem
    is convex. The alternating direction method of multipliers [2]_ (split Bregman [3]_) solves it
    in rounds, each of which clips the residuals and solves the Poisson equation exactly once. Where
    every residual is below ``outlier_slope`` and every slope is valid, the result is that of
    ``integrate``.

    Wrong slopes that are consistent with some surface, such as slopes that are too shallow all
    around a ball, leave no residual and cannot be detected.

    Parameters
    ----------
    gx, gy : (H, W)
        ∂z/∂x and ∂z/∂y, dimensionless.
    mm_per_px : float
        Distance of neighbouring pixels.
    valid : (H, W) bool, optional
        False where a slope was filled in; its weight is a tenth.
    outlier_slope : float
        Residual from which a slope is an outlier: about the error of a good slope, 0.02 for 1°.
        Far below that error the noise of good slopes is no longer averaged; 0 minimises the sum of
        the sizes of the residuals (L1).
    rounds : int
        Iterations; each takes about as long as ``integrate``.

    Returns
    -------
    (H, W) float32
        Height in mm, mean 0.

    Raises
    ------
    InputError
        Shapes differ or are not 2-D, a slope is not finite, or the scale is not positive.

    References
    ----------
    .. [1] P. J. Huber, "Robust estimation of a location parameter", Annals of Mathematical
       Statistics 35(1), 1964.
    .. [2] S. Boyd, N. Parikh, E. Chu, B. Peleato and J. Eckstein, "Distributed optimization and
       statistical learning via the alternating direction method of multipliers", Foundations and
       Trends in Machine Learning 3(1), 2011.
    .. [3] T. Goldstein and S. Osher, "The split Bregman method for L1-regularized problems", SIAM
       Journal on Imaging Sciences 2(2), 2009.
    """
    gx, gy = np.asarray(gx), np.asarray(gy)
    gx, gy = gx.astype(np.float32, copy=False), gy.astype(np.float32, copy=False)
    height = integrate(gx, gy, mm_per_px=mm_per_px)
    if valid is not None and valid.shape != height.shape:
        raise InputError(f"valid is {valid.shape} where the slopes are {height.shape}")
    rise = _at_faces(gx, gy) * np.float32(mm_per_px)
    weight = None if valid is None or valid.all() else _weights(valid)
    most = np.float32(_STEP_SLOPE * mm_per_px)
    gain = np.float32(_STEP_SLOPE / (_STEP_SLOPE + outlier_slope))
    multipliers, residual = np.zeros_like(rise), np.zeros_like(rise)
    for _ in range(rounds):
        np.subtract(height[:, 1:], height[:, :-1], out=residual[0, :, :-1])
        np.subtract(height[1:], height[:-1], out=residual[1, :-1])
        residual -= rise
        residual += multipliers
        residual *= gain
        updated = np.clip(residual, -most, most, out=residual)
        if weight is not None:
            updated *= weight
        multipliers -= updated
        multipliers -= updated
        height += solve_poisson(_divergence(multipliers), "neumann")
        multipliers, residual = updated, multipliers
    return height


def _at_faces(gx: Array, gy: Array) -> Float32:
    """Mean slopes at the face to the right and the face below, (2, H, W); 0 without a face."""
    faces = np.zeros((2, *gx.shape), np.float32)
    faces[0, :, :-1] = 0.5 * (gx[:, 1:] + gx[:, :-1])
    faces[1, :-1] = 0.5 * (gy[1:] + gy[:-1])
    return faces


def _weights(valid: Bool) -> Float32:
    """Weight of each face, (2, H, W); a face next to a filled pixel has the weight of that."""
    # [ratio] Any measured slope around filled ones prevails (ADR 4)
    weight = np.where(valid, np.float32(1), np.float32(0.1))
    faces = np.ones((2, *valid.shape), np.float32)
    np.minimum(weight[:, 1:], weight[:, :-1], out=faces[0, :, :-1])
    np.minimum(weight[1:], weight[:-1], out=faces[1, :-1])
    return faces


def _divergence(flow: Float32) -> Float32:
    """Flow out of each pixel through its faces minus the flow into it, (H, W)."""
    total: Float32 = flow[0] + flow[1]
    total[:, 1:] -= flow[0, :, :-1]
    total[1:] -= flow[1, :-1]
    return total
