"""Compiled loops for a stream of virtual frames: the extra ``fast``, as in the algorithms.

The numpy version beside each call is the definition. A virtual stage chooses them once, when it is
made.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from tactile_core.algorithms import kernels as of_algorithms

if TYPE_CHECKING:
    from types import ModuleType


@cache
def load() -> ModuleType | None:
    """Import the kernels, if they may be used; each is compiled once per installation.

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
    """Return the kernels if they are asked for and there are any."""
    return load() if compiled else None
