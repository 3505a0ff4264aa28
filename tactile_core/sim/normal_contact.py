"""Which pressure keeps a skin from passing through a rigid object."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array


@dataclass(frozen=True)
class NormalContact:
    """A solved contact.

    Attributes
    ----------
    pressure : (ny, nx)
        MPa, nowhere negative, and zero wherever there is a gap.
    approach_mm : float
        By how much the object was lowered beyond what was asked; 0 unless a force was given.
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
    most_iterations: int = 300,
) -> NormalContact:
    """Find the pressure p ≥ 0 under which the skin touches the object or leaves a gap, never both.

    Constrained conjugate gradients after Polonsky and Keer (Wear 231, 1999): steps are taken over
    the nodes in contact, negative pressures are cut off, and nodes that would be passed through
    join the contact.

    Parameters
    ----------
    indentation : callable
        (ny, nx) indentation in mm under a pressure; linear, symmetric and positive.
    overlap_mm : (ny, nx)
        How far the object would reach into the undeformed skin; negative where it does not.
    start : (ny, nx)
        Pressure to start from, for example the last one; may be zero everywhere.
    total_mpa : float, optional
        Sum of the pressures over all nodes. The object is then lowered or raised until it is met;
        without it, the object stays where ``overlap_mm`` says.
    tolerance : float
        Largest root-mean-square gap inside the contact, as a share of the deepest overlap.
    most_iterations : int
    """
    forced = total_mpa is not None
    p = np.maximum(start, 0)
    if forced and not p.any():
        p = np.ones_like(overlap_mm)  # from too wide a contact it shrinks; one node would stay one
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
    while iterations < most_iterations:
        iterations += 1
        gap = indentation(p) - overlap_mm
        touching = p > 0
        if forced:
            approach = float(gap[touching].mean())
            gap = gap - approach
        inside = np.where(touching, gap, 0)
        square = float((inside * inside).sum())
        scale = tolerance * max(float(overlap_mm.max()) + approach, 1e-9)
        if (
            square <= scale**2 * np.count_nonzero(touching)
            and not ((gap < -10 * scale) & ~touching).any()
        ):
            break
        direction = inside if restart else inside + (square / before) * direction * touching
        before = square
        response = indentation(direction)
        if forced:
            response = response - float(response[touching].mean())
        curvature = float((response * direction).sum())
        if curvature <= 0:
            break
        length = float((inside * direction).sum()) / curvature
        p = np.maximum(p - length * direction, 0)
        joining = (p == 0) & (gap < 0)
        restart = bool(joining.any())
        if restart:
            p[joining] = -length * gap[joining]
        if forced:
            p *= total_mpa / p.sum()
    return NormalContact(p, approach, iterations)
