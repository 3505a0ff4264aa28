"""Compiled loops that render virtual frames at camera rate; they need the extra ``fast``.

The numpy code next to each call is the reference implementation. A virtual stage decides once, at
construction, whether to use the compiled loops.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from tactile_core.algorithms import kernels as of_algorithms

if TYPE_CHECKING:
    from types import ModuleType


@cache
def load() -> ModuleType | None:
    """Import the kernels if numba is available; each is compiled once per installation.

    Returns
    -------
    module or None
        :mod:`tactile_core.sim.kernels.compiled`.
    """
    if of_algorithms.load() is None:
        return None
    from tactile_core.sim.kernels import compiled

    return compiled


def chosen(compiled: bool) -> ModuleType | None:
    """Return the kernels if requested and available, else None."""
    return load() if compiled else None
