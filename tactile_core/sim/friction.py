"""Which shear traction holds a skin to a rigid object, and where it gives way.

Coulomb's law at every node: the traction is at most friction times pressure; below that the skin
sticks to the object, at it the skin slips against the traction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.arrays.types import Array
from tactile_core.sim.response import Response

_RELAXATION = 1.6


@dataclass(frozen=True)
class Grip:
    """A solved friction.

    Attributes
    ----------
    traction : (2, ny, nx)
        MPa, of the object on the skin.
    slip_mm : (2, ny, nx)
        By how much the skin fell short of the wanted displacement; exactly zero where it sticks.
    resolution_mm : float
        Slip that the tolerance cannot tell from none.
    iterations : int
    """

    traction: Array
    slip_mm: Array
    resolution_mm: float = 0.0
    iterations: int = 0

    @classmethod
    def none(cls, shape: tuple[int, int], dtype: DTypeLike) -> Grip:
        """Return no traction and no slip on a grid of this shape."""
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
    most_iterations: int = 300,
) -> Grip:
    """Find the traction q, no larger than its limit, under which the skin follows or slips.

    Minimises ½ q·C q − q·wanted under |q| ≤ limit by the alternating direction method of
    multipliers (Boyd et al. 2011): one step solves the elastic layer exactly by Fourier
    transforms, the other cuts the traction off node by node, and the multiplier between them is
    the slip.

    Parameters
    ----------
    layer : Response
    wanted_mm : (2, ny, nx)
        Displacement that a skin which sticks everywhere would get from the traction.
    limit_mpa : (ny, nx)
        Friction times pressure; zero out of contact.
    start : Grip
        To start from, for example the last one; may be none at all.
    stiffening : float
        How much stiffer than its elastomer the layer is, within a step in time.
    free_slip_mm : float
        For friction that grows with speed: slip in this step at which the limit has doubled; 0 is
        a limit that does not depend on speed.
    tolerance : float
        Largest change of a traction, and mismatch between both steps, as a share of the largest.
    most_iterations : int
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
        # Beyond the window nothing is wanted; with what happens there anyway, there is no slip.
        beyond = layer.shift(q) / stiffening
        beyond[..., : inside[0], : inside[1]] = wanted[..., : inside[0], : inside[1]]
        wanted = beyond.astype(layer.dtype, copy=False)
    tiny = np.finfo(layer.dtype).tiny
    iterations = 0
    while iterations < most_iterations:
        iterations += 1
        free = respond(wanted + rho * (q - slip))
        trial = _RELAXATION * free + (1 - _RELAXATION) * q + slip
        size = np.sqrt(trial[0] ** 2 + trial[1] ** 2)
        held = limit
        if free_slip_mm > 0:
            extra = free_slip_mm / rho
            held = np.where(size > limit, limit * (size + extra) / (limit + extra), limit)
        new = trial * np.minimum(1, held / np.maximum(size, tiny))
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
