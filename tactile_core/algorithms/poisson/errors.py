"""Standard deviations of integrated heights."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tactile_core.algorithms.arrays.types import Float32


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
