"""Normal contact, the balance of a load, and windows of the grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

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


def balance_load(
    force_n: Callable[[float], float], load_n: float, *, first_mm: float, at_most_mm: float
) -> float:
    """Return the motion at which the gel's shear force balances a load.

    Doubles the motion until the force exceeds the load, then narrows the bracket by Brent's method.
    If the force never reaches the load, friction is exceeded and the object moves as far as it can.

    Parameters
    ----------
    force_n : callable
        Motion in mm along the load to the shear force against it, N.
    load_n : float
        Positive.
    first_mm : float
        First trial: the motion in which a sticking contact would take up the load.
    at_most_mm : float
        Largest motion along the load. It may move back by any distance.

    Returns
    -------
    float
        Motion along the load, mm; negative if the load has decreased.
    """
    from scipy.optimize import brentq

    excess = cache(lambda travel_mm: force_n(travel_mm) - load_n)
    if abs(excess(0.0)) <= 0.01 * load_n:  # twice the error of the shear force in fast mode
        return 0.0
    ahead = excess(0.0) < 0
    limit_mm = at_most_mm if ahead else -1024 * first_mm
    near, far = 0.0, first_mm if ahead else -first_mm
    while (excess(far) < 0) == ahead and abs(far) < abs(limit_mm):
        near, far = far, 2 * far
    if abs(far) >= abs(limit_mm):
        far = limit_mm
    if (excess(far) < 0) == ahead:
        return limit_mm
    return float(brentq(excess, near, far, xtol=0.003 * abs(far)))


_MARGIN_NODES = 2  # [nodes] Margin on each side of the contact
# [nodes] Window sizes are multiples of this, so that a contact that grows slightly reuses the
# response of the last step
_MULTIPLE = 8


@dataclass(frozen=True)
class Window:
    """Contiguous rows and columns of a grid.

    Attributes
    ----------
    rows, columns : slice
        Both have explicit start and stop.
    """

    rows: slice
    columns: slice

    @classmethod
    def around(cls, nodes: NDArray[np.bool_]) -> Window:
        """Return a window that contains these nodes (at least one) and a margin."""
        return cls(_wide(np.asarray(nodes.any(1))), _wide(np.asarray(nodes.any(0))))

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.rows.stop - self.rows.start, self.columns.stop - self.columns.start

    def view_of(self, field: Array) -> Array:
        """Return a view of the window in an array whose last two axes are the grid's."""
        return field[..., self.rows, self.columns]

    def contains(self, nodes: NDArray[np.bool_]) -> bool:
        """Whether all of these nodes are inside."""
        return bool(np.count_nonzero(nodes) == np.count_nonzero(self.view_of(nodes)))

    def reaches_its_border(self, nodes: NDArray[np.bool_]) -> bool:
        """Whether any of these nodes is on a border of the window that is inside the grid.

        Parameters
        ----------
        nodes : (ny, nx)
            Mask on the whole grid.
        """
        inside = self.view_of(nodes)
        (top, bottom), (left, right) = (
            (part.start > 0, part.stop < size)
            for part, size in zip((self.rows, self.columns), nodes.shape, strict=True)
        )
        return bool(
            (top and inside[0].any())
            or (bottom and inside[-1].any())
            or (left and inside[:, 0].any())
            or (right and inside[:, -1].any())
        )

    def embed_part(self, part: Array, shape: tuple[int, int]) -> Array:
        """Embed a part in an array of the whole grid that is zero outside the window."""
        whole = np.zeros((*part.shape[:-2], *shape), part.dtype)
        self.view_of(whole)[...] = part
        return whole


def _wide(taken: NDArray[np.bool_]) -> slice:
    first = int(taken.argmax())
    last = len(taken) - int(taken[::-1].argmax())
    margin = _MARGIN_NODES + int(0.1 * (last - first))  # [share of the contact] and a margin
    size = -(-(last - first + 2 * margin) // _MULTIPLE) * _MULTIPLE
    if 2 * size >= len(taken):
        return slice(0, len(taken))
    start = min(max((first + last - size) // 2, 0), len(taken) - size)
    return slice(start, start + size)
