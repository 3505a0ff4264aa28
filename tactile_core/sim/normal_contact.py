"""Normal contact, the balance of a load, and windows of the grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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


class BALANCE:
    """Parameters of the search for a balance of forces. They trade accuracy for time."""

    # [share of the load] Largest difference between load and shear force. Source: twice the error
    # of the shear force in fast mode, whose friction solver has a tolerance of 0.005 of the
    # largest traction.
    tolerance = 0.01
    # [ratio] Factor on a linear extrapolation, because the contact becomes softer as more of it
    # slips. Source: by hand, it affects the number of trials, not the result.
    overshoot = 1.3
    # [count] Largest number of trial steps. Source: by hand, halvings of the longest motion that
    # reach a thousandth of it.
    max_trials = 12


def balance_load(
    force_n: Callable[[float], float], load_n: float, *, first_mm: float, at_most_mm: float
) -> float:
    """Return the motion at which the gel's shear force balances a load.

    Expands the motion until the force exceeds the load, then narrows the bracket by regula falsi
    (Illinois). If the force never reaches the load, friction is exceeded and the object moves as
    far as it can.

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
    close = BALANCE.tolerance * load_n
    start = force_n(0.0) - load_n
    if abs(start) <= close:
        return 0.0
    sign, limit_mm = (-1.0, float("inf")) if start > 0 else (1.0, at_most_mm)
    if limit_mm == 0:
        return 0.0
    near, near_excess = 0.0, start
    far = sign * min(first_mm, limit_mm)
    trials = 1
    while True:
        trials += 1
        excess = force_n(far) - load_n
        if abs(excess) <= close:
            return far
        if excess * start < 0:
            break
        if abs(far) >= limit_mm or trials >= BALANCE.max_trials:
            return min(far, limit_mm) if sign < 0 else limit_mm
        slope = (excess - near_excess) / (far - near)
        step = BALANCE.overshoot * abs(excess / slope) if slope > 0 else limit_mm
        near, near_excess = far, excess
        far = sign * min(abs(far) + max(step, abs(far)), limit_mm)
    far_excess, side = excess, 0
    while trials < BALANCE.max_trials:
        trials += 1
        middle = (near * far_excess - far * near_excess) / (far_excess - near_excess)
        excess = force_n(middle) - load_n
        if abs(excess) <= close:
            return middle
        if excess * far_excess > 0:
            far, far_excess = middle, excess
            near_excess *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            near, near_excess = middle, excess
            far_excess *= 0.5 if side < 0 else 1.0
            side = -1
    return near if abs(near_excess) < abs(far_excess) else far


_MARGIN_NODES = 2  # [nodes] Margin on each side of the contact
_MARGIN_SHARE = 0.1  # [share of the contact's size] Further margin on each side
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
    margin = _MARGIN_NODES + int(_MARGIN_SHARE * (last - first))
    size = -(-(last - first + 2 * margin) // _MULTIPLE) * _MULTIPLE
    if 2 * size >= len(taken):
        return slice(0, len(taken))
    start = min(max((first + last - size) // 2, 0), len(taken) - size)
    return slice(start, start + size)
