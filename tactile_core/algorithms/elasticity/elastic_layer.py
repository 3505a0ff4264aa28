"""Surface displacement of an elastic layer bonded to a rigid plate, by Fourier transforms.

Linear elasticity at any thickness: the surface displacement at each wave number is proportional to
the load, so a Fourier transform turns loads into displacements.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.elasticity.elastomer import Elastomer
from tactile_core.algorithms.elasticity.grid import Grid
from tactile_core.algorithms.elasticity.response import Response, Symbols


class ElasticLayer(Response):
    """Elastic layer on a periodic grid: loads to displacements.

    Parameters
    ----------
    grid : Grid
    elastomer : Elastomer
    dtype : float32 or float64
        Type of all computations; float32 is accurate to 1e-6 of the largest displacement.
    against : Elastomer, optional
        A soft layer that is pressed onto this one: displacements are then the sum of both normal
        ones, and the relative tangential ones.
    weight : float
        Factor on the displacements of the other layer.

    References
    ----------
    .. [1] Stanley, Kato, "An FFT-Based Method for Rough Surface Contact", Journal of Tribology 119,
       1997.
    """

    def __init__(
        self,
        grid: Grid,
        elastomer: Elastomer,
        dtype: DTypeLike = np.float32,
        *,
        against: Elastomer | None = None,
        weight: float = 1.0,
    ) -> None:
        self.grid, self.elastomer = grid, elastomer
        symbols = _symbols(grid, elastomer)
        if against is not None:
            symbols = _paired(symbols, _symbols(grid, against), weight)
        super().__init__(grid.shape, symbols, dtype)
        self._near: tuple[tuple[int, int], Response] | None = None

    def near(self, shape: tuple[int, int]) -> Response:
        """Return the response of a window of the grid to loads inside it.

        A small window is faster than the whole grid and gives the same displacements up to
        rounding.

        Parameters
        ----------
        shape : (rows, columns)
            Size of the window.

        Returns
        -------
        Response
            On a padded grid whose first rows and columns are the window's. It has at least twice
            the window's size where the grid allows, so that the periodic images of a load do not
            reach the window.
        """
        size = _round(shape[0], self.grid.ny), _round(shape[1], self.grid.nx)
        if size == self.shape:
            return self
        if self._near is None or self._near[0] != size:
            self._near = size, self._cropped(size)
        return self._near[1]


def _symbols(grid: Grid, elastomer: Elastomer) -> Symbols:
    step = 2 * np.pi / grid.spacing_mm
    kx = step * np.fft.rfftfreq(grid.nx)[None, :]
    ky = step * np.fft.fftfreq(grid.ny)[:, None]
    k = np.hypot(kx, ky)
    compliance = elastomer.compliance(k)
    cos, sin = (np.divide(side, k, out=np.zeros_like(k), where=k > 0) for side in (kx, ky))
    # a wave and its mirror image coincide at the Nyquist frequency: odd symbols vanish there
    below_nyquist = np.ones_like(k)
    if grid.ny % 2 == 0:
        below_nyquist[grid.ny // 2] = 0
    if grid.nx % 2 == 0:
        below_nyquist[:, -1] = 0
    xx = compliance.along * cos**2 + compliance.across * sin**2
    yy = compliance.along * sin**2 + compliance.across * cos**2
    xx[0, 0] = yy[0, 0] = compliance.across[0, 0]
    return Symbols(
        compliance.normal,
        compliance.coupling * np.stack([cos, sin]) * below_nyquist,
        xx,
        yy,
        (compliance.along - compliance.across) * cos * sin * below_nyquist,
    )


def _paired(one: Symbols, other: Symbols, weight: float) -> Symbols:
    """Add the compliances of two layers that press on each other.

    Both surfaces spread alike under the same pressure, so their coupling is subtracted.
    """
    weights = weight, -weight, weight, weight, weight
    return Symbols(*(a + part * b for a, b, part in zip(one, other, weights, strict=True)))


def _round(part: int, whole: int) -> int:
    """Number of nodes that pads a part against wrap-around; the whole if that is no larger."""
    from scipy.fft import next_fast_len

    return whole if 2 * part >= whole else min(whole, int(next_fast_len(2 * part, real=True)))
