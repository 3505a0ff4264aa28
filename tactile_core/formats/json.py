"""JSON files and printable text."""

from __future__ import annotations

import math
import reprlib
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


_MAX_LENGTH = 60  # Characters of a text, of a number and of any other value in a message


class _Brief(reprlib.Repr):
    def __init__(self) -> None:
        super().__init__()
        self.maxlevel = 2
        self.maxstring = self.maxother = self.maxlong = _MAX_LENGTH

    def repr_int(self, value: int, level: int) -> str:
        # Python raises an error for a number with thousands of digits
        if value.bit_length() > 8 * _MAX_LENGTH:
            return f"a number of {value.bit_length()} bits"
        return super().repr_int(value, level)


_BRIEF = _Brief()


def shorten_repr(value: object) -> str:
    """Return a value's shortened ``repr``, of limited length for any value."""
    text = printable(_BRIEF.repr(value))
    return text if len(text) <= 2 * _MAX_LENGTH else text[: 2 * _MAX_LENGTH - 1] + "…"


def printable(text: str) -> str:
    """Return text on one line; control and unprintable characters are escaped."""
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape").decode() for char in text
    )
