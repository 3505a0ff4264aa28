"""How a soft layer that is bonded to a rigid plate yields to loads on its surface.

Linear elasticity without approximation of thickness: at each wave number the surface moves in
proportion to its load, so a Fourier transform turns loads into displacements.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.elasticity import Elastomer
from tactile_core.sim.grid import Grid
from tactile_core.sim.response import Response, Symbols


class ElasticLayer(Response):
    """The layer on a grid: from loads to displacements.

    Parameters
    ----------
    grid : Grid
    elastomer : Elastomer
    dtype : float32 or float64
        In which everything is computed; float32 is good to 1e-6 of the largest displacement.
    """

    def __init__(self, grid: Grid, elastomer: Elastomer, dtype: DTypeLike = np.float32) -> None:
        self.grid, self.elastomer = grid, elastomer
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
        xx = found.along * cos**2 + found.across * sin**2
        yy = found.along * sin**2 + found.across * cos**2
        xx[0, 0] = yy[0, 0] = found.across[0, 0]
        super().__init__(
            grid.shape,
            Symbols(
                found.normal,
                found.coupling * np.stack([cos, sin]) * odd,
                xx,
                yy,
                (found.along - found.across) * cos * sin * odd,
            ),
            dtype,
        )
        self._near: tuple[tuple[int, int], Response] | None = None

    def near(self, shape: tuple[int, int]) -> Response:
        """Return what loads on a window of the grid do to this window; of few nodes, it is quick.

        Parameters
        ----------
        shape : (rows, columns)
            Of the window.

        Returns
        -------
        Response
            Of nodes that begin with the window's; those behind it belong to no place. Between
            nodes of the window it is what the whole layer does: no two are further apart than
            half of its size.
        """
        size = _round(shape[0], self.grid.ny), _round(shape[1], self.grid.nx)
        if size == self.shape:
            return self
        if self._near is None or self._near[0] != size:
            self._near = size, self._cut(size)
        return self._near[1]


def _round(part: int, whole: int) -> int:
    """Nodes that nothing reaches round them from one end of a part to the other."""
    from scipy.fft import next_fast_len

    return whole if 2 * part >= whole else min(whole, int(next_fast_len(2 * part, real=True)))
