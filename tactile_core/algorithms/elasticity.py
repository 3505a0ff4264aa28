"""How a soft layer that is bonded to a rigid plate yields to a wave of load on its surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Array

THICKNESS_MM, SHEAR_MODULUS_MPA, POISSON_RATIO = 2.0, 0.145, 0.48
"""Of a gel of which nobody tells: the silicone of most sensors of this family."""


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
