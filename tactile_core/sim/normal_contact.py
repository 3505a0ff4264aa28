"""Normal contact of the gel surface with a rigid object: contact area and pressure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array


@dataclass(frozen=True)
class NormalContact:
    """Solution of the normal contact problem.

    Attributes
    ----------
    pressure : (ny, nx)
        MPa, non-negative, and zero wherever there is a gap.
    approach_mm : float
        Depth by which the object was lowered to reach the given force; 0 at a given depth.
    iterations : int
    """

    pressure: Array
    approach_mm: float
    iterations: int


def solve_normal(
    indentation: Callable[[Array], Array],
    overlap_mm: Array,
    start: Array,
    *,
    total_mpa: float | None = None,
    tolerance: float = 1e-4,
    max_iterations: int = 300,
) -> NormalContact:
    """Solve for the contact pressure p ≥ 0: zero gap under pressure, zero pressure at a gap.

    Uses the constrained conjugate gradients of Polonsky and Keer [1]_: a descent step over the
    contact nodes, then truncation of negative pressures; nodes that penetrate the object join the
    contact.

    Parameters
    ----------
    indentation : callable
        (ny, nx) pressure to (ny, nx) indentation in mm; linear, symmetric, positive definite.
    overlap_mm : (ny, nx)
        Overlap of the object with the undeformed gel surface; negative at a gap.
    start : (ny, nx)
        Initial pressure, for example that of the last step; may be zero.
    total_mpa : float, optional
        Sum of the pressures over all nodes. If given, the object is lowered or raised to reach
        it; otherwise its height is fixed by ``overlap_mm``.
    tolerance : float
        Convergence threshold: root-mean-square gap inside the contact, relative to the largest
        overlap.
    max_iterations : int

    References
    ----------
    .. [1] Polonsky, Keer, "A numerical method for solving rough contact problems based on the
       multi-level multi-summation and conjugate gradient techniques", Wear 231, 1999.
    """
    forced = total_mpa is not None
    p = np.maximum(start, 0)
    if forced and not p.any():
        p = np.ones_like(overlap_mm)  # a contact that starts too large shrinks to the solution
    elif not forced:
        if overlap_mm.max() <= 0:
            return NormalContact(np.zeros_like(p), 0.0, 0)
        if not p.any():
            p = np.maximum(overlap_mm, 0)
            response = indentation(p)
            p = p * (float((p * overlap_mm).sum()) / max(float((p * response).sum()), 1e-30))
    if forced:
        p = p * (total_mpa / p.sum())
    direction, before, restart, approach = np.zeros_like(p), 1.0, True, 0.0
    iterations = 0
    deepest = float(overlap_mm.max())
    while iterations < max_iterations:
        iterations += 1
        gap = indentation(p) - overlap_mm
        touching = p > 0
        if forced:
            approach = float(gap[touching].mean())
            gap -= approach
        inside = gap * touching
        square = float(np.vdot(inside, inside))
        scale = tolerance * max(deepest + approach, 1e-9)
        if (
            square <= scale**2 * np.count_nonzero(touching)
            and not ((gap < -10 * scale) > touching).any()
        ):
            break
        if restart:
            direction = inside
        else:
            direction *= square / before
            direction *= touching
            direction += inside
        before = square
        response = indentation(direction)
        if forced:
            response -= float(response[touching].mean())
        curvature = float(np.vdot(response, direction))
        if curvature <= 0:
            break
        length = float(np.vdot(inside, direction)) / curvature
        p = np.maximum(p - length * direction, 0)
        joining = (gap < 0) > (p > 0)
        restart = bool(joining.any())
        if restart:
            p[joining] = -length * gap[joining]
        if forced:
            p *= total_mpa / p.sum()
    return NormalContact(p, approach, iterations)
