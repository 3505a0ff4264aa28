"""Compiled loops for a stream of images: the extra ``fast``, which adds numba.

The numpy version beside each call is the definition; a kernel gives the same to 1e-5 and is there
only where it is measurably faster. None is used before somebody who expects many images has called
:func:`load`, since importing numba takes longer than measuring a single image. Where numba is not
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


def ready() -> ModuleType | None:
    """Return the kernels once they are loaded, None before and where there are none."""
    return load() if load.cache_info().currsize else None
