"""Layers of elastomer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.force.response import Response, Symbols
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid


class Compliance(NamedTuple):
    """Displacement per traction at given wave numbers, mm/MPa.

    With q the shear traction along the wave (L) or across it (T) and p the pressure,

        u_L = along q_L − i coupling p,    u_T = across q_T,    w = normal p + i coupling q_L

    where w is the indentation.

    Attributes
    ----------
    along, across, normal, coupling : array of float64
        In the shape of the wave numbers.
    """

    along: Array
    across: Array
    normal: Array
    coupling: Array


@dataclass(frozen=True)
class Elastomer:
    """A linear elastic layer of uniform thickness.

    Attributes
    ----------
    thickness_mm : float
        Thickness of the layer. ``inf`` is a half-space, for comparison with textbooks; its mean
        displacement is undefined and set to zero.
    shear_modulus_mpa : float
    poisson_ratio : float
        At most 0.5, an incompressible material.

    References
    ----------
    .. [1] K. L. Johnson, "Contact Mechanics", Cambridge University Press, 1985.
    """

    thickness_mm: float
    shear_modulus_mpa: float
    poisson_ratio: float

    def compliance(self, wave_number: Array) -> Compliance:
        """Return the compliance at wave numbers k ≥ 0, in 1/mm.

        The lower face of the layer is fixed and its upper face is loaded by a sine wave. With
        κ = 3 − 4ν and a = k h, the solutions share the denominator 2 κ cosh 2a + 1 + κ² + 4 a²,
        except across the wave, where the layer is in simple shear.
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
        decay = np.exp(-2 * a)  # all terms are divided by exp(2a), which would overflow
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
    """Elastic layer on a periodic grid: loads to displacements.

    Parameters
    ----------
    grid : SurfaceGrid
    elastomer : Elastomer
    dtype : float32 or float64
        Type of all computations; float32 is accurate to 1e-6 of the largest displacement.

    References
    ----------
    .. [1] Stanley, Kato, "An FFT-Based Method for Rough Surface Contact", Journal of Tribology 119,
       1997.
    """

    def __init__(
        self,
        grid: SurfaceGrid,
        elastomer: Elastomer,
        dtype: DTypeLike = np.float32,
    ) -> None:
        self.grid, self.elastomer = grid, elastomer
        super().__init__(grid.shape, _symbols(grid, elastomer), dtype)
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
            self._near = size, self._crop_response(size)
        return self._near[1]


def _symbols(grid: SurfaceGrid, elastomer: Elastomer) -> Symbols:
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


def _round(part: int, whole: int) -> int:
    """Number of nodes that pads a part against wrap-around; the whole if that is no larger."""
    from scipy.fft import next_fast_len

    return whole if 2 * part >= whole else min(whole, int(next_fast_len(2 * part, real=True)))


THICKNESS_MM = 2.0  # [mm] The test sheet of [1]_: 23.4 × 22.6 × 2.0 mm
SHEAR_MODULUS_MPA = 0.145  # [MPa] Neo-Hookean coefficient of the silicone XP-565 [1]_
POISSON_RATIO = 0.48  # [ratio] Nearly incompressible, chosen by hand: the papers give none
