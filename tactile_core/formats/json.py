"""Plain values, as JSON knows them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """Return the value as strict JSON can hold it.

    What is not finite becomes None, as JSON has no word for it; tuples become lists.

    Raises
    ------
    TypeError
        Something in it is neither text, number, mapping nor sequence.
    """
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    raise TypeError(f"a {type(value).__name__} is nothing that JSON can hold")
