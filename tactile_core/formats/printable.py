"""Values and names as messages show them: short, on one line, and harmless to a terminal."""

from __future__ import annotations

import reprlib

_LONGEST = 60


class _Brief(reprlib.Repr):
    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxstring, self.maxother, self.maxlong = 2, _LONGEST, _LONGEST, _LONGEST

    def repr_int(self, value: int, level: int) -> str:
        # Python refuses to write out a number of thousands of digits
        if value.bit_length() > 8 * _LONGEST:
            return f"a number of {value.bit_length()} bits"
        return super().repr_int(value, level)


_BRIEF = _Brief()


def shown(value: object) -> str:
    """Return a value as Python writes it, shortened however large it is."""
    text = printable(_BRIEF.repr(value))
    return text if len(text) <= 2 * _LONGEST else text[: 2 * _LONGEST - 1] + "…"


def printable(text: str) -> str:
    """Return a text on one line: what a terminal would obey, or could not show, is escaped."""
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape").decode() for char in text
    )
