"""Kernel of :mod:`tactile_core.sim.friction`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.kernels.options import LOOP


@njit(**LOOP)
def limited(
    free: Array,
    wanted: Array,
    limit: Array,
    relaxation: float,
    free_slip_mm: float,
    trial: Array,
    held: Array,
    target: Array,
) -> tuple[Any, Any, Any]:
    """Project the displacement that friction can hold onto Coulomb's limit.

    Parameters
    ----------
    free : (2, M, N)
        Solution without a limit, times the over-relaxation.
    wanted : (2, M, N)
        Displacement that full stick would require.
    limit : (m, n)
        Largest displacement that friction holds, in the first rows and columns of the grid.
    relaxation : float
        Over-relaxation.
    free_slip_mm : float
        As in :func:`~tactile_core.sim.friction.solve_friction`.
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
    # numbers of the arrays' own type, lest everything become double precision
    one, alpha, slack = limit.dtype.type(1), limit.dtype.type(relaxation), limit.dtype.type(0)
    slack += limit.dtype.type(free_slip_mm)
    change = mismatch = largest = limit.dtype.type(0)
    for part in range(2):
        for i in range(free.shape[1]):
            for j in range(free.shape[2]):
                trial[part, i, j] += free[part, i, j]
                target[part, i, j] = wanted[part, i, j] - trial[part, i, j]
    for i in range(rows):
        for j in range(columns):
            x = trial[0, i, j] - alpha * held[0, i, j]
            y = trial[1, i, j] - alpha * held[1, i, j]
            trial[0, i, j], trial[1, i, j] = x, y
            share, most = one, limit[i, j]
            size = np.sqrt(x * x + y * y)
            if size > most:
                if slack > 0:
                    most *= (size + slack) / (most + slack)
                share = most / size
            x, y = x * share, y * share
            change = max(change, abs(x - held[0, i, j]), abs(y - held[1, i, j]))
            largest = max(largest, abs(x), abs(y))
            if limit[i, j] > 0:
                free_x, free_y = free[0, i, j] / alpha, free[1, i, j] / alpha
                mismatch = max(mismatch, abs(free_x - x), abs(free_y - y))
            held[0, i, j], held[1, i, j] = x, y
            target[0, i, j] = wanted[0, i, j] - trial[0, i, j] + x + x
            target[1, i, j] = wanted[1, i, j] - trial[1, i, j] + y + y
    return change, mismatch, largest
