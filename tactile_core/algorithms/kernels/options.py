"""How every kernel is compiled."""

from __future__ import annotations

from typing import Any

LOOP: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
"""A whole image: no fast mathematics, and other threads run meanwhile."""

EXACT_ROW: dict[str, Any] = {**LOOP, "inline": "never"}
"""One row at a time in a function of its own is what the compiler turns into vectors."""

ROW: dict[str, Any] = {**EXACT_ROW, "fastmath": True}
"""The same where sums may be taken in any order."""
