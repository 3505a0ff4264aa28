"""Conversion of values to strict JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """Return a value that strict JSON can represent.

    Infinite and NaN numbers become None, because JSON has no such numbers. Tuples become lists.

    Raises
    ------
    TypeError
        A value in it is not text, a number, a mapping or a sequence.
    """
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    raise TypeError(f"JSON cannot represent a {type(value).__name__}")
