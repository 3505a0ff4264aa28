"""Screened and plain Laplacians."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.arrays.types import Array, Float32


class SCREENED:
    """Parameters of the iterative solution. Nothing sets them: they trade time for digits."""

    # [ratio] Norm of the preconditioned residual over that of the source. Source: by hand, :
    # heights of presses differ by less than 0.1 µm from those at 1e-6.
    tolerance = 5e-3
    most_rounds = 60  # [count] Upper bound of the iterations, of which 3 to 6 are usual


# Keeps the equation of a constant solvable where no cell has a weight.
_TINY = float(np.finfo(np.float64).tiny)


def solve_screened(source: Array, weight: Array) -> Array:
    """Solve ``weight · z − Σ (neighbour − z) = source``.

    It minimises the squared differences of neighbours plus ``weight · (z − source / weight)²``.
    Conjugate gradients [1]_ run on the coefficients of the cosine transform, where the differences
    are a diagonal matrix, and are preconditioned by the same equation with the mean weight. On
    small grids that transform is fastest as a matrix product.

    Parameters
    ----------
    source : (H, W)
    weight : (H, W)
        Not negative, and positive somewhere. The fewer iterations, the more even it is.

    Returns
    -------
    (H, W) float64
        z.

    References
    ----------
    .. [1] M. R. Hestenes and E. Stiefel, "Methods of conjugate gradients for solving linear
       systems", Journal of Research of the National Bureau of Standards 49(6), 1952.
    """
    (down, across, up, back), modes = _prepare_transforms(source.shape)
    gain = 1 / (modes + max(float(weight.sum()) / weight.size, _TINY))

    def applied(z: Array) -> Array:
        weighted = up @ z @ across
        weighted *= weight
        weighted = down @ weighted @ back
        weighted += modes * z
        return np.asarray(weighted)

    residual = down @ np.asarray(source, np.float64) @ back
    step = gain * residual
    energy = float(np.vdot(residual, step))
    enough = SCREENED.tolerance**2 * energy
    z = np.zeros(source.shape)
    direction = step
    for _ in range(SCREENED.most_rounds):
        if not energy > enough:
            break
        change = applied(direction)
        length = energy / float(np.vdot(direction, change))
        z += length * direction
        change *= length
        residual -= change
        step = gain * residual
        before, energy = energy, float(np.vdot(residual, step))
        direction = step + (energy / before) * direction
    return np.asarray(up @ z @ across)


@lru_cache(maxsize=16)
def _prepare_transforms(shape: tuple[int, int]) -> tuple[tuple[Array, Array, Array, Array], Array]:
    """Return the cosine transforms along both axes, their transposes, and the stiffness."""
    down, across = (_cosines(side) for side in shape)
    back = np.ascontiguousarray(down.T), np.ascontiguousarray(across.T)
    return (down, across, *back), _stiffness(*shape)


@lru_cache(maxsize=16)
def _cosines(side: int) -> Array:
    """Orthonormal DCT-II as a (side, side) matrix."""
    k = np.arange(side)
    matrix = np.cos(np.pi * k[:, None] * (k + 0.5) / side) * np.sqrt(2 / side)
    matrix[0] /= np.sqrt(2)
    return np.asarray(matrix)


@lru_cache(maxsize=16)
def _stiffness(rows: int, columns: int) -> Array:
    """Factor of each coefficient when the differences to neighbours are summed, (rows, columns)."""
    down, across = (2 - 2 * np.cos(np.pi * np.arange(n) / n) for n in (rows, columns))
    return np.asarray(down[:, None] + across)


Boundary = Literal["neumann", "dirichlet"]

_ZERO = 1e-15  # [ratio] Eigenvalues above minus this are that of the free constant


class Laplacian:
    """Invertible Laplacian of one image size; immutable, so several threads may use it at once.

    Parameters
    ----------
    shape : (height, width) in px
    boundary : "neumann" or "dirichlet"
    dtype : float32 or float64
    """

    def __init__(
        self, shape: tuple[int, int], boundary: Boundary, dtype: DTypeLike = np.float32
    ) -> None:
        self._boundary = boundary
        first = 0 if boundary == "neumann" else 1
        rows, columns = (_eigenvalues(np.arange(n) + first, n + first) for n in shape)
        eigenvalues = rows[:, None] + columns
        # the constant, which has no slope, is set to 0
        free = eigenvalues > -_ZERO
        self._gain = np.where(free, 0, 1 / np.where(free, 1, eigenvalues)).astype(dtype)

    def solve(self, rhs: Array) -> Array:
        """Solve L z = rhs with L z = Σ (neighbour − z).

        With a Neumann border the mean of ``rhs`` is removed and that of z is 0.

        Parameters
        ----------
        rhs : (H, W)
            Overwritten.

        Returns
        -------
        (H, W)
            z.
        """
        from scipy import fft

        cosine, sine = (fft.dctn, fft.idctn, 2), (fft.dstn, fft.idstn, 1)
        forward, backward, kind = cosine if self._boundary == "neumann" else sine
        how: dict[str, Any] = {"type": kind, "norm": "ortho", "overwrite_x": True, "workers": 1}
        spectrum = forward(rhs, **how)
        spectrum *= self._gain
        return np.asarray(backward(spectrum, **how))


@lru_cache(maxsize=8)
def laplacian(
    shape: tuple[int, int], boundary: Boundary, dtype: DTypeLike = np.float32
) -> Laplacian:
    """Return the Laplacian of an image size, boundary and precision, which is kept."""
    return Laplacian(shape, boundary, dtype)


def _eigenvalues(k: Array, n: int) -> Array:
    return np.asarray(2 * np.cos(np.pi * k / n) - 2)


def height_std(slope_std: Float32, cell_mm: tuple[float, float], correlation_mm: float) -> Float32:
    """Propagate errors of slopes to the height that is integrated from them.

    A height is the integral of the slopes with the gradient of the Green's function of the Poisson
    equation, which falls off as 1 / (2 π r) [1]_. Errors of slopes are taken as independent beyond
    ``correlation_mm`` and equal within it, so that variances add:
    σ² = (c / 2π)² ∫ σ_slope² / (r² + c²) dA.

    Parameters
    ----------
    slope_std : (h, w) float32
        Standard deviation of the slopes in cells that tile the image.
    cell_mm : (float, float)
        Height and width of a cell.
    correlation_mm : float
        Correlation length of errors of slopes.

    Returns
    -------
    (h, w) float32, mm

    References
    ----------
    .. [1] R. T. Frankot and R. Chellappa, "A Method for Enforcing Integrability in Shape from
       Shading Algorithms", IEEE Transactions on Pattern Analysis and Machine Intelligence 10(4),
       1988.
    """
    from scipy import fft

    rows, columns = slope_std.shape
    kernel, padded = _kernel(slope_std.shape, cell_mm, correlation_mm)
    spectrum = fft.rfft2(slope_std * slope_std, padded)
    variance = fft.irfft2(spectrum * kernel, padded)[:rows, :columns]
    return np.sqrt(np.maximum(variance, 0), dtype=np.float32)


@lru_cache(maxsize=8)
def _kernel(
    shape: tuple[int, int], cell_mm: tuple[float, float], correlation_mm: float
) -> tuple[np.ndarray, tuple[int, int]]:
    """Return the transform of the kernel of the integral, and its padded shape."""
    from scipy import fft

    padded = (
        fft.next_fast_len(2 * shape[0], real=True),
        fft.next_fast_len(2 * shape[1], real=True),
    )
    down, across = (fft.fftfreq(n, 1 / n) * mm for n, mm in zip(padded, cell_mm, strict=True))
    far = down[:, None] ** 2 + across**2 + correlation_mm**2
    share = cell_mm[0] * cell_mm[1] * (correlation_mm / (2 * np.pi)) ** 2
    return fft.rfft2((share / far).astype(np.float32)), padded
