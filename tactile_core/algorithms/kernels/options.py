"""Options of numba with which the kernels are compiled."""

from __future__ import annotations

from typing import Any

LOOP: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
"""For loops over a whole image: exact arithmetic, and the lock is released for other threads."""

EXACT_ROW: dict[str, Any] = {**LOOP, "inline": "never"}
"""For loops over one row. The compiler vectorises a loop in a function of its own."""

ROW: dict[str, Any] = {**EXACT_ROW, "fastmath": True}
"""For loops over one row whose sums may be taken in any order."""
