"""Height from slopes on a full or masked image."""

from __future__ import annotations

from math import isfinite
from typing import get_args

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_core.algorithms.poisson.divergence import double_divergence
from tactile_core.algorithms.poisson.laplacian import Boundary, laplacian
from tactile_core.errors import InputError

_BOUNDARIES = get_args(Boundary)


class PoissonSolver:
    """Integrate the slopes of many images of one size; see :func:`integrate`.

    Parameters
    ----------
    shape : (height, width) in px
    mm_per_px : float
    boundary : "neumann" or "dirichlet"

    Raises
    ------
    InputError
        The shape is empty, the scale is not positive or the boundary is unknown.

    References
    ----------
    .. [1] T. Simchony, R. Chellappa and M. Shao, "Direct analytical methods for solving Poisson
       equations in computer vision problems", IEEE Transactions on Pattern Analysis and Machine
       Intelligence 12(5), 1990.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        *,
        mm_per_px: float,
        boundary: Boundary = "neumann",
    ) -> None:
        _check_arguments(shape, mm_per_px, boundary)
        self.shape = shape
        self.mm_per_px = mm_per_px
        self.boundary = boundary

    def solve(self, gx: Array, gy: Array) -> Float32:
        """Return the height in mm.

        Parameters
        ----------
        gx, gy : (H, W)
            ∂z/∂x and ∂z/∂y, dimensionless.

        Returns
        -------
        (H, W) float32

        Raises
        ------
        InputError
            A shape is not that of the solver, or a slope is not finite.
        """
        _check_shapes(self.shape, gx, gy)
        gx, gy = (np.ascontiguousarray(g, np.float32) for g in (gx, gy))
        rhs = double_divergence(gx, gy, self.boundary)
        rhs *= np.float32(0.5 * self.mm_per_px)
        return _checked(laplacian(self.shape, self.boundary).solve(rhs))


def integrate(
    gx: Array,
    gy: Array,
    *,
    mm_per_px: float,
    boundary: Boundary = "neumann",
    mask: Bool | None = None,
) -> Float32:
    """Integrate slopes to the height that fits them best in the least-squares sense.

    Between neighbouring pixels the height should rise by ``mm_per_px`` times the mean of their
    two slopes. The normal equations are a Poisson equation, as in [1]_, solved exactly up to
    rounding by cosine or sine transforms [2]_. Unlike the Fourier projection of [3]_, the solution
    is not periodic. For slopes sampled from a smooth surface, the mean of two has the error of the
    trapezoidal rule: a wave of period P px loses 3.3 / P² of its amplitude, 0.1 % of its range at
    P = 40.

    Parameters
    ----------
    gx, gy : (H, W)
        ∂z/∂x (x right) and ∂z/∂y (y down), dimensionless.
    mm_per_px : float
        Distance of neighbouring pixels.
    boundary : "neumann" or "dirichlet"
        "neumann": the border is free and the mean height is 0. "dirichlet": the height is 0 at the
        pixels one step outside the image, where the slope extrapolates the last two linearly.
    mask : (H, W) bool, optional
        True where the slope was measured. Only faces between two such pixels count; other slopes
        are ignored. Each 4-connected part of the mask has a free constant, so its mean is 0, except
        for a part that "dirichlet" connects to the border. Outside the mask the height is
        continued smoothly.

    Returns
    -------
    (H, W) float32
        Height in mm, finite everywhere.

    Raises
    ------
    InputError
        Shapes differ or are not 2-D, a slope is not finite, the mask is empty or not boolean,
        the scale is not positive, or the boundary is unknown.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: high-resolution robot tactile sensors for
       estimating geometry and force", Sensors 17(12), 2017, equations 3 and 4.
    .. [2] T. Simchony, R. Chellappa and M. Shao, "Direct analytical methods for solving Poisson
       equations in computer vision problems", IEEE Transactions on Pattern Analysis and Machine
       Intelligence 12(5), 1990.
    .. [3] R. T. Frankot and R. Chellappa, "A method for enforcing integrability in shape from
       shading algorithms", IEEE Transactions on Pattern Analysis and Machine Intelligence 10(4),
       1988.
    """
    gx, gy = np.asarray(gx), np.asarray(gy)
    _check_arguments(gx.shape, mm_per_px, boundary)
    _check_shapes(gx.shape, gx, gy)
    if mask is not None and not _check_mask(mask, gx.shape).all():
        from tactile_core.algorithms.poisson.masked import solve_masked

        _checked((np.where(mask, gx, 0) + np.where(mask, gy, 0)).reshape(1, -1))
        return np.asarray(mm_per_px * solve_masked(gx, gy, boundary, mask), np.float32)
    if np.result_type(gx, gy, np.float32) == np.float32:
        return PoissonSolver(gx.shape, mm_per_px=mm_per_px, boundary=boundary).solve(gx, gy)
    gx, gy = (np.ascontiguousarray(g, np.float64) for g in (gx, gy))
    rhs = (0.5 * mm_per_px) * double_divergence(gx, gy, boundary)
    return _checked(laplacian(gx.shape, boundary, np.float64).solve(rhs).astype(np.float32))


def _check_arguments(shape: tuple[int, ...], mm_per_px: float, boundary: str) -> None:
    if len(shape) != 2 or 0 in shape:
        raise InputError(
            f"slopes of shape {shape} cannot be integrated; give two (H, W) arrays of at least "
            f"one pixel"
        )
    if not 0 < mm_per_px < np.inf:
        raise InputError(f"mm_per_px is {mm_per_px}; give the positive size of a pixel in mm")
    if boundary not in _BOUNDARIES:
        raise InputError(f"boundary {boundary!r} is unknown; choose 'neumann' or 'dirichlet'")


def _check_shapes(shape: tuple[int, ...], gx: Array, gy: Array) -> None:
    if not gx.shape == gy.shape == shape:
        raise InputError(
            f"gx is {gx.shape} and gy {gy.shape} where both must be {shape} (height, width)"
        )


def _check_mask(mask: Bool, shape: tuple[int, ...]) -> Bool:
    if mask.shape != shape or mask.dtype != bool:
        raise InputError(
            f"the mask is {mask.shape} {mask.dtype}; give {shape} bool, True where the slope was "
            f"measured"
        )
    if not mask.any():
        raise InputError("the mask is False everywhere; give at least one measured pixel")
    return mask


def _checked(values: Array) -> Array:
    # one slope that is not finite makes the whole solution so, and checking one row is enough
    if not isfinite(values[0] @ values[0]) and not np.isfinite(values[0]).all():
        raise InputError(
            "a slope is NaN or infinite; fill it in, or leave it out by mask=True where measured"
        )
    return values
