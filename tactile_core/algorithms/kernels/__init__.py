"""Compiled loops for a stream of images: the extra ``fast``, which adds numba.

The numpy version beside each call is the definition; a kernel gives the same to 1e-5 and is there
only where it saves a fiftieth of the whole operation that it is part of. Whoever expects many
images chooses them once, when a pipeline or a virtual stage is made, since importing numba takes
longer than measuring hundreds of images; functions are told by an argument. Where numba is not
installed, or the environment says ``TACTILE_FAST=0``, numpy does all of it.
"""

from __future__ import annotations

import os
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType

SWITCH = "TACTILE_FAST"
"""Name of the environment variable that turns the kernels off when it is 0."""


@cache
def load() -> ModuleType | None:
    """Import the kernels, if they may be used; each is compiled once per installation.

    Returns
    -------
    module or None
        :mod:`tactile_core.algorithms.kernels.compiled`.
    """
    if os.environ.get(SWITCH) == "0" or find_spec("numba") is None:
        return None
    try:
        from tactile_core.algorithms.kernels import compiled
    except ImportError:
        # numba refuses every numpy that is newer than itself
        return None
    return compiled


def chosen(compiled: bool) -> ModuleType | None:
    """Return the kernels if they are asked for and there are any."""
    return load() if compiled else None
