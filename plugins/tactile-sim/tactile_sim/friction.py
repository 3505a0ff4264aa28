"""Coulomb friction between the gel surface and a rigid object: stick, partial slip and slip.

Coulomb's law holds at every node: the shear traction is at most the friction coefficient times the
pressure. Below this limit the gel surface sticks to the object; at the limit it slips.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.force.response import Response

# [ratio] Over-relaxation α of the alternating direction method of multipliers: Boyd et al. 2011,
# section 3.4.3, recommend 1.5 to 1.8; chosen in this range by hand
_OVER_RELAXATION = 1.6


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
    alpha = _OVER_RELAXATION
    # tractions times rho are displacements; their sum with the slip is the state of the iteration
    respond = layer.resolvent(rho, stiffening, gain=alpha * rho)
    inside = limit_mpa.shape
    q, slip, limit = (
        part.astype(layer.dtype, copy=False)
        for part in (rho * start.traction, start.slip_mm, rho * limit_mpa)
    )
    wanted, trial = (
        _pad_part(part.astype(layer.dtype, copy=False), layer.shape)
        for part in (wanted_mm, q + slip)
    )
    here = np.s_[..., : inside[0], : inside[1]]
    if inside != layer.shape:
        # Outside the window no displacement is prescribed: the actual one gives zero slip there.
        beyond = layer.shift(_pad_part(start.traction, layer.shape)) / stiffening
        beyond[here] = wanted[here]
        wanted = beyond.astype(layer.dtype, copy=False)
    target = wanted - trial
    target[here] += 2 * q
    iterations, largest = 0, 0.0
    while iterations < max_iterations:
        iterations += 1
        free = respond(target)
        change, mismatch, largest = _limit_friction(
            free, wanted, limit, free_slip_mm, trial, q, target
        )
        if max(change, mismatch) <= tolerance * max(largest, 1e-12 * rho):
            break
    slip = trial[here] - q
    return Grip(q / rho, slip, float(tolerance * largest), iterations)


def _limit_friction(
    free: Array,
    wanted: Array,
    limit: Array,
    free_slip_mm: float,
    trial: Array,
    held: Array,
    target: Array,
) -> tuple[float, float, float]:
    """Project the displacement that friction can hold onto Coulomb's limit.

    Parameters
    ----------
    free : (2, M, N)
        Solution without a limit, times the over-relaxation.
    wanted : (2, M, N)
        Displacement that full stick would require.
    limit : (m, n)
        Largest displacement that friction holds, in the first rows and columns of the grid.
    free_slip_mm : float
        As in :func:`solve_friction`.
    trial : (2, M, N)
        State of the iteration, replaced by the next.
    held : (2, m, n)
        Displacement held by friction, replaced by the next.
    target : (2, M, N)
        Overwritten by the displacement for the next half-step.

    Returns
    -------
    change, mismatch, largest : float
        Largest change of ``held``, largest difference from ``free`` in the contact, and largest
        component of ``held``.
    """
    rows, columns = limit.shape
    relaxation = _OVER_RELAXATION
    trial += free
    here, free_here = trial[:, :rows, :columns], free[:, :rows, :columns]
    here -= relaxation * held
    size = np.sqrt(here[0] ** 2 + here[1] ** 2)
    bound = limit
    if free_slip_mm > 0:
        faster = limit * (size + free_slip_mm) / (limit + free_slip_mm)
        bound = np.where(size > limit, faster, limit)
    new = here * (bound / np.maximum(np.maximum(size, bound), np.finfo(limit.dtype).tiny))
    change = np.abs(new - held).max()
    mismatch = (np.abs(free_here / relaxation - new) * (limit > 0)).max()
    held[...] = new
    np.subtract(wanted, trial, out=target)
    target[:, :rows, :columns] += 2 * new
    return float(change), float(mismatch), float(np.abs(new).max())


def _pad_part(part: Array, shape: tuple[int, int]) -> Array:
    rows, columns = part.shape[-2:]
    if (rows, columns) == shape:
        return part
    whole = np.zeros((*part.shape[:-2], *shape), part.dtype)
    whole[..., :rows, :columns] = part
    return whole
