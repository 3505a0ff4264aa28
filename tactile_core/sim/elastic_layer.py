"""How a soft layer that is bonded to a rigid plate yields to loads on its surface.

Linear elasticity without approximation of thickness: at each wave number the surface moves in
proportion to its load, so a Fourier transform turns loads into displacements.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tactile_core.sim.grid import Grid
from tactile_core.sim.response import Response, Symbols

Array = NDArray[Any]


class Compliance(NamedTuple):
    """Displacement for each unit of traction at some wave numbers, mm/MPa.

    With q the shear traction along the wave (L) or across it (T) and p the pressure,

        u_L = along q_L − i coupling p,    u_T = across q_T,    w = normal p + i coupling q_L

    where w is the indentation.
    """

    along: Array
    across: Array
    normal: Array
    coupling: Array


@dataclass(frozen=True)
class Elastomer:
    """What the gel is made of.

    Attributes
    ----------
    thickness_mm : float
        Of the layer; ``inf`` is a half-space, for comparison with textbooks. Its mean displacement
        has no meaning and is kept at zero.
    shear_modulus_mpa : float
    poisson_ratio : float
        Up to and including 0.5.
    """

    thickness_mm: float
    shear_modulus_mpa: float
    poisson_ratio: float

    def compliance(self, wave_number: Array) -> Compliance:
        """Compliance at wave numbers k ≥ 0, in 1/mm.

        Solves the equations of a layer whose lower face is held and whose upper face is loaded by
        a wave. With κ = 3 − 4ν and a = k h, all four share the denominator
        2 κ cosh 2a + 1 + κ² + 4 a², except that across the wave the layer is in plain shear.
        """
        k = np.asarray(wave_number, np.float64)
        mu, nu, h = self.shear_modulus_mpa, self.poisson_ratio, self.thickness_mm
        safe = np.where(k > 0, k, 1.0)
        soft = 1 / (mu * safe)
        if np.isinf(h):
            moves = k > 0
            plane = np.where(moves, (1 - nu) * soft, 0.0)
            coupling = np.where(moves, -(0.5 - nu) * soft, 0.0)
            return Compliance(plane, np.where(moves, soft, 0.0), plane, coupling)
        kappa, a = 3 - 4 * nu, safe * h
        decay = np.exp(-2 * a)  # everything divided by exp(2a), which overflows
        shared = kappa * (1 + decay**2) + (1 + kappa**2 + 4 * a**2) * decay
        sinh, tail = kappa * (1 - decay**2), 4 * a * decay
        bend = kappa * (kappa - 1) / 4
        coupled = (bend * (2 * decay - 1 - decay**2) + 2 * a**2 * decay) * soft / shared
        confined = (1 - 2 * nu) / (2 * mu * (1 - nu))  # 1 / (λ + 2µ)
        return Compliance(
            along=np.where(k > 0, (1 - nu) * soft * (sinh + tail) / shared, h / mu),
            across=np.where(k > 0, soft * np.tanh(a), h / mu),
            normal=np.where(k > 0, (1 - nu) * soft * (sinh - tail) / shared, h * confined),
            coupling=np.where(k > 0, coupled, 0.0),
        )


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
