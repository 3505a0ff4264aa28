"""Compiled loops for streams of images; they need the extra ``fast``, which adds numba.

The numpy code next to each call is the definition. A kernel agrees with it to 1e-5, and exists only
where it saves at least a fiftieth of the operation that it is part of. Importing numba takes longer
than measuring hundreds of images, so a pipeline or a virtual stage chooses the kernels once, when
it is made, and passes the choice as the argument ``compiled``. Without numba, or with
``TACTILE_FAST=0`` in the environment, numpy is used throughout.
"""

from __future__ import annotations

import os
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType

SWITCH = "TACTILE_FAST"
"""Name of the environment variable that disables the kernels when it is 0. When it is 1, they are
compiled where they are needed first, instead of in another process."""


@cache
def load() -> ModuleType | None:
    """Import the kernels. Each is compiled once per installation.

    Returns
    -------
    module or None
        :mod:`tactile_core.algorithms.kernels.compiled`; None where they are disabled or numba is
        missing.
    """
    if os.environ.get(SWITCH) == "0" or find_spec("numba") is None:
        return None
    try:
        from tactile_core.algorithms.kernels import compiled
    except (ImportError, RuntimeError):
        # numba refuses a numpy newer than itself, and to compile what it can cache nowhere
        return None
    return compiled


def chosen(compiled: bool) -> ModuleType | None:
    """Return the kernels if they are requested and available."""
    return load() if compiled else None
