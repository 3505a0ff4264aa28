"""How a soft layer that is bonded to a rigid plate yields to loads on its surface.

Linear elasticity without approximation of thickness: at each wave number the surface moves in
proportion to its load, so a Fourier transform turns loads into displacements.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tactile_core.algorithms.elasticity import Elastomer
from tactile_core.sim.grid import Grid

Array = NDArray[Any]


class ElasticLayer:
    """The layer on a grid: from loads to displacements.

    Parameters
    ----------
    grid : Grid
    elastomer : Elastomer
    dtype : float32 or float64
        In which everything is computed; float32 is good to 1e-6 of the largest displacement.
    """

    def __init__(self, grid: Grid, elastomer: Elastomer, dtype: DTypeLike = np.float32) -> None:
        self.grid, self.elastomer, self.dtype = grid, elastomer, np.dtype(dtype)
        step = 2 * np.pi / grid.spacing_mm
        kx = step * np.fft.rfftfreq(grid.nx)[None, :]
        ky = step * np.fft.fftfreq(grid.ny)[:, None]
        k = np.hypot(kx, ky)
        found = elastomer.compliance(k)
        cos, sin = (np.divide(side, k, out=np.zeros_like(k), where=k > 0) for side in (kx, ky))
        # at the highest frequency a wave and its mirror image are one: what is odd has no value
        odd = np.ones_like(k)
        if grid.ny % 2 == 0:
            odd[grid.ny // 2] = 0
        if grid.nx % 2 == 0:
            odd[:, -1] = 0
        self._normal = found.normal.astype(self.dtype)
        self._coupling = (found.coupling * np.stack([cos, sin]) * odd).astype(self.dtype)
        self._xx = (found.along * cos**2 + found.across * sin**2).astype(self.dtype)
        self._yy = (found.along * sin**2 + found.across * cos**2).astype(self.dtype)
        self._xx[0, 0] = self._yy[0, 0] = found.across[0, 0]
        self._xy = ((found.along - found.across) * cos * sin * odd).astype(self.dtype)

    def indentation(self, pressure: Array) -> Array:
        """(ny, nx) indentation in mm under a pressure (ny, nx) in MPa alone."""
        return self._back(self._normal * self._forth(pressure))

    def shift(self, traction: Array) -> Array:
        """(2, ny, nx) tangential displacement in mm under a shear traction (2, ny, nx) alone."""
        x, y = self._forth(traction)
        return self._back(np.stack([self._xx * x + self._xy * y, self._xy * x + self._yy * y]))

    def spread(self, pressure: Array) -> Array:
        """(2, ny, nx) tangential displacement under a pressure alone: outwards."""
        return self._back(self._coupling * (-1j * self._forth(pressure)))

    def bulge(self, traction: Array) -> Array:
        """(ny, nx) indentation under a shear traction alone."""
        x, y = 1j * self._forth(traction)
        return self._back(self._coupling[0] * x + self._coupling[1] * y)

    def resolvent(self, rho: float, stiffening: float = 1.0) -> Resolvent:
        """Return the solver of (C / stiffening + rho) q = b for a traction, C being :meth:`shift`.

        Parameters
        ----------
        rho : float
            mm/MPa.
        stiffening : float
            How much stiffer than the elastomer says the layer is.
        """
        xx, yy, xy = (part / stiffening for part in (self._xx, self._yy, self._xy))
        return Resolvent(self, xx + rho, yy + rho, xy)

    @cached_property
    def typical_shift(self) -> float:
        """Geometric mean of the softest and the stiffest wave's tangential compliance, mm/MPa."""
        values = self._xx[self._xx > 0]
        return float(np.sqrt(values.max() * values.min()))

    def _forth(self, field: Array) -> NDArray[Any]:
        from scipy.fft import rfft2

        return np.asarray(rfft2(field.astype(self.dtype, copy=False), workers=1))

    def _back(self, waves: NDArray[Any]) -> Array:
        from scipy.fft import irfft2

        return np.asarray(irfft2(waves, s=self.grid.shape, workers=1))


class Resolvent:
    """Solves (C / stiffening + rho) q = b in one pair of transforms; see :class:`ElasticLayer`."""

    def __init__(self, layer: ElasticLayer, xx: Array, yy: Array, xy: Array) -> None:
        self._layer = layer
        determinant = xx * yy - xy**2
        self._xx, self._yy, self._xy = yy / determinant, xx / determinant, -xy / determinant

    def __call__(self, wanted: Array) -> Array:
        """(2, ny, nx) traction that answers this displacement (2, ny, nx)."""
        x, y = self._layer._forth(wanted)
        return self._layer._back(
            np.stack([self._xx * x + self._xy * y, self._xy * x + self._yy * y])
        )
