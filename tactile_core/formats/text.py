"""JSON and YAML files, and printable text."""

from __future__ import annotations

import io
import math
import reprlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.files import read_text


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


# Largest file, bytes. It takes about 10 s to read; a scan with a thousand drawn circles has a tenth
# of this size.
MAX_BYTES = 1_000_000

_HUGE = 1e30  # No number in such files is larger

_MAX_EXPANDED = 10 * MAX_BYTES  # Largest content after all aliases are expanded, characters


def read_mapping(path: Path) -> dict[str, Any]:
    """Read a YAML 1.2 file whose top level is a mapping.

    Raises
    ------
    InputError
        The file is missing, too large, not text, not YAML (with line and column), nested too
        deeply, too large after its aliases are expanded, or not a mapping.
    """
    path = Path(path)
    return mapping_of(read_text(path, MAX_BYTES), path)


def mapping_of(text: str, path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML 1.2 text.

    Parameters
    ----------
    text : str
    path : Path
        Where it comes from, in messages.

    Raises
    ------
    InputError
        As :func:`read_mapping`.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    yaml = YAML(typ="safe", pure=True)
    yaml.allow_duplicate_keys = True
    try:
        constructor, _ = yaml.get_constructor_parser(text)
        tree = constructor.composer.get_single_node()
        if _count_expanded(tree, {}) > _MAX_EXPANDED:
            raise InputError(
                f"{path} grows without limit by its aliases (*); replace them by their values"
            )
        content = None if tree is None else constructor.construct_document(tree)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        where = f":{mark.line + 1}:{mark.column + 1}" if mark is not None else ""
        raise InputError(f"{path}{where}: this is not YAML: {error.problem}") from None
    except RecursionError:
        raise InputError(f"{path}: this YAML cannot be read: it is nested too deeply") from None
    except (YAMLError, ValueError, OverflowError, TypeError) as error:
        words = (str(error) or "a value cannot be read").splitlines()[0]
        raise InputError(f"{path}: this is not YAML: {words}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path} is not a mapping of keys to values")
    return {str(key): value for key, value in content.items()}


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


def _count_expanded(node: Any, known: dict[int, int]) -> int:
    """Characters of a tree of nodes after all its aliases are expanded."""
    if id(node) in known:
        return known[id(node)]
    known[id(node)] = _MAX_EXPANDED + 1  # in case the node contains itself
    inside = getattr(node, "value", None) or ()
    if isinstance(inside, str):
        count = len(inside)
    else:
        flat = (part for item in inside for part in (item if isinstance(item, tuple) else (item,)))
        count = sum(_count_expanded(part, known) for part in flat)
    known[id(node)] = count + 1
    return count + 1
