"""Coulomb friction between the gel surface and a rigid object: stick, partial slip and slip.

Coulomb's law holds at every node: the shear traction is at most the friction coefficient times the
pressure. Below this limit the gel surface sticks to the object; at the limit it slips.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.elasticity.response import Response


class FrictionParameters(NamedTuple):
    """Parameters of the friction solver. They affect its speed, not its solution.

    Attributes
    ----------
    over_relaxation : float, ratio
        Over-relaxation α of the alternating direction method of multipliers.
        Source: Boyd et al. 2011, section 3.4.3, recommend 1.5 to 1.8; chosen in this range by
        hand.
    """

    over_relaxation: float = 1.6


FRICTION_SOLVER = FrictionParameters()
"""The values in use."""


@dataclass(frozen=True)
class Grip:
    """Solution of the friction problem.

    Attributes
    ----------
    traction : (2, ny, nx)
        Shear traction of the object on the gel surface, MPa.
    slip_mm : (2, ny, nx)
        Wanted minus actual displacement; exactly zero where the surface sticks.
    resolution_mm : float
        Largest slip that is within the solver's tolerance of zero.
    iterations : int
    """

    traction: Array
    slip_mm: Array
    resolution_mm: float = 0.0
    iterations: int = 0

    @classmethod
    def none(cls, shape: tuple[int, int], dtype: DTypeLike) -> Grip:
        """Return zero traction and zero slip on a grid of this shape."""
        return cls(np.zeros((2, *shape), dtype), np.zeros((2, *shape), dtype))


def solve_friction(
    layer: Response,
    wanted_mm: Array,
    limit_mpa: Array,
    start: Grip,
    *,
    stiffening: float = 1.0,
    free_slip_mm: float = 0.0,
    tolerance: float = 1e-3,
    max_iterations: int = 300,
) -> Grip:
    """Solve for the shear traction q under Coulomb's law.

    Minimises ½ q·C q − q·wanted subject to |q| ≤ limit by the alternating direction method of
    multipliers [1]_. One half-step solves the elastic layer exactly by Fourier transforms, the
    other projects the traction onto the limit node by node. The multiplier is the slip.

    Parameters
    ----------
    layer : Response
    wanted_mm : (2, ny, nx)
        Tangential displacement that full stick would require.
    limit_mpa : (ny, nx)
        Friction coefficient times pressure; zero outside the contact.
    start : Grip
        Initial solution, for example that of the last step.
    stiffening : float
        Viscoelastic stiffness of the layer within this step, relative to the relaxed stiffness.
    free_slip_mm : float
        Slip within this step at which rate-dependent friction doubles the limit; 0 for a limit
        that does not depend on speed.
    tolerance : float
        Convergence threshold on the change of traction and on the mismatch between both
        half-steps, relative to the largest traction.
    max_iterations : int

    References
    ----------
    .. [1] Boyd, Parikh, Chu, Peleato, Eckstein, "Distributed Optimization and Statistical Learning
       via the Alternating Direction Method of Multipliers", Foundations and Trends in Machine
       Learning 3, 2011.
    """
    rho = layer.typical_shift / stiffening
    respond = layer.resolvent(rho, stiffening)
    inside = limit_mpa.shape
    limit, wanted, q, slip = (
        _padded(part.astype(layer.dtype, copy=False), layer.shape)
        for part in (limit_mpa, wanted_mm, start.traction, start.slip_mm / rho)
    )
    touching = limit > 0
    if inside != layer.shape:
        # Outside the window no displacement is prescribed: the actual one gives zero slip there.
        beyond = layer.shift(q) / stiffening
        beyond[..., : inside[0], : inside[1]] = wanted[..., : inside[0], : inside[1]]
        wanted = beyond.astype(layer.dtype, copy=False)
    tiny = np.finfo(layer.dtype).tiny
    iterations = 0
    while iterations < max_iterations:
        iterations += 1
        free = respond(wanted + rho * (q - slip))
        alpha = FRICTION_SOLVER.over_relaxation
        trial = alpha * free + (1 - alpha) * q + slip
        size = np.sqrt(trial[0] ** 2 + trial[1] ** 2)
        bound = limit
        if free_slip_mm > 0:
            extra = free_slip_mm / rho
            bound = np.where(size > limit, limit * (size + extra) / (limit + extra), limit)
        new = trial * np.minimum(1, bound / np.maximum(size, tiny))
        slip = trial - new
        change = float(np.abs(new - q).max())
        mismatch = float((np.abs(free - new) * touching).max())
        q = new
        if max(change, mismatch) <= tolerance * max(float(np.abs(q).max()), 1e-12):
            break
    slack = tolerance * rho * float(np.abs(q).max())
    q, slip = (part[..., : inside[0], : inside[1]] for part in (q, slip * rho))
    return Grip(q, slip, slack, iterations)


def _padded(part: Array, shape: tuple[int, int]) -> Array:
    rows, columns = part.shape[-2:]
    if (rows, columns) == shape:
        return part
    whole = np.zeros((*part.shape[:-2], *shape), part.dtype)
    whole[..., :rows, :columns] = part
    return whole
