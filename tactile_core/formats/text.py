"""Values as JSON and YAML, and printable text."""

from __future__ import annotations

import io
import math
import reprlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError


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


_HUGE = 1e30  # No number in such files is larger


def yaml_text(values: Mapping[str, Any]) -> str:
    """Return JSON-ready values as YAML 1.2, in their order."""
    from ruamel.yaml import YAML

    yaml: Any = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False
    buffer = io.StringIO()
    yaml.dump(dict(values), buffer)
    return buffer.getvalue()


def number(
    value: object, path: Path, key: str, *, low: float = -math.inf, high: float = math.inf
) -> float:
    """Return a finite number from ``low`` to ``high``.

    Raises
    ------
    InputError
        The value is not a finite number or is out of range.
    """
    # _HUGE is below the integers for which float() overflows
    good = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _HUGE
    if not good:
        raise InputError(f"{path}: {key} must be a number, not {shorten_repr(value)}")
    assert isinstance(value, int | float)
    if not low <= value <= high:
        raise InputError(
            f"{path}: {key} must be from {low:g} to {high:g}, not {shorten_repr(value)}"
        )
    return float(value)
