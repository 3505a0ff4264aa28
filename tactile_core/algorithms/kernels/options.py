"""Options of numba with which the kernels are compiled."""

from __future__ import annotations

from typing import Any

LOOP: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,  # a way in from C, which nothing takes
}
"""For loops over a whole image: exact arithmetic, and the lock is released for other threads."""

PART: dict[str, Any] = {**LOOP, "no_cpython_wrapper": True}
"""For what only other kernels call. Without a way in from Python it compiles faster."""

EXACT_ROW: dict[str, Any] = {**PART, "inline": "never"}
"""For loops over one row. The compiler vectorises a loop in a function of its own."""

ROW: dict[str, Any] = {**EXACT_ROW, "fastmath": True}
"""For loops over one row whose sums may be taken in any order."""
