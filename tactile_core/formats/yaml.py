"""YAML files of other programs: read leniently, refused in one sentence, written whole."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes, write_atomically


def read_mapping(path: Path) -> dict[str, Any]:
    """Read a YAML 1.2 file whose top level is a mapping.

    Raises
    ------
    InputError
        The file is missing, no text, no YAML (with line and column) or no mapping.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    path = Path(path)
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is no text file in UTF-8") from None
    yaml = YAML(typ="safe", pure=True)
    yaml.allow_duplicate_keys = True
    try:
        content = yaml.load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        where = f":{mark.line + 1}:{mark.column + 1}" if mark is not None else ""
        raise InputError(f"{path}{where}: this is not YAML: {error.problem}") from None
    except (YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: this is not YAML: {str(error).splitlines()[0]}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path} is no mapping of keys to values")
    return {str(key): value for key, value in content.items()}


def write_mapping(path: Path, content: Mapping[str, Any]) -> None:
    """Write a mapping as YAML, whole or not at all.

    Raises
    ------
    OSError
        The disk is full or refuses.
    """
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    buffer = io.BytesIO()
    yaml.dump(dict(content), buffer)
    write_atomically(path, buffer.getvalue())


def number(value: object, path: Path, key: str) -> float:
    """Return a finite number.

    Raises
    ------
    InputError
        It is something else.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{path}: {key} must be a number, not {value!r}")
    return float(value)
