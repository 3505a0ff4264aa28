"""Translates pydantic's errors into plain sentences with positions."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from tactile_core.algorithms.arrays.types import parts
from tactile_core.errors import Problem
from tactile_core.formats.yaml_tree import Keys, Node, problem_at
from tactile_core.plugins.earlier_names import KEYS

# What a value "should be", by pydantic's error type.
_WORDS = {
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "text",
    "path_type": "a path",
    "model_type": "a mapping of keys to values",
    "dict_type": "a mapping of keys to values",
    "list_type": "a list",
    "tuple_type": "a list",
    "greater_than": "greater than {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "less_than": "less than {lt:g}",
    "less_than_equal": "at most {le:g}",
    "literal_error": "{expected}",
}

MISSING = "is missing; add it"
_LONGEST_SHOWN = 40


def problems_of(
    error: ValidationError, tree: Node, model: type[BaseModel], prefix: Keys = ()
) -> list[Problem]:
    """Convert a validation error to one problem per mistake.

    Parameters
    ----------
    error : ValidationError
    tree : Node
        The complete profile that was validated, with positions.
    model : type
        The model that rejected it.
    prefix : Keys
        Path of the model's mapping in the tree.
    """
    start = tree.node_at(prefix) or tree
    by_keys: dict[Keys, list[Any]] = {}
    for one in error.errors(include_url=False):
        keys = _written_keys(start, one["loc"], model)
        by_keys.setdefault(keys, []).append(one)
    meant = _find_misspelt(by_keys, model)
    found = []
    for keys, errors in by_keys.items():
        inner = any(other[: len(keys)] == keys and len(other) > len(keys) for other in by_keys)
        if keys in meant or (inner and all(len(one["loc"]) > len(keys) for one in errors)):
            continue  # reported at the misspelt key, or by the alternative that was intended
        message = _sentence(errors, start.node_at(keys), model, keys)
        instead = KEYS.get((_owner(start, keys), str(keys[-1]))) if keys else None
        if instead and errors[0]["type"] == "extra_forbidden":
            message = f"is a key of an earlier version; {instead}"
        found.append(problem_at(start.origin(keys), (*prefix, *keys), message))
    return found


def _owner(start: Node, keys: Keys) -> str:
    """Return the component that a mapping describes, else the keys of the one with a mistake."""
    use = start.get("use")
    return ".".join(map(str, keys[:-1])) if use is None else str(use.value)


def _written_keys(start: Node, loc: Keys, model: type[BaseModel]) -> Keys:
    """Return the keys of an error location, without pydantic's names of union alternatives."""
    node: Node | None = start
    kept: list[str | int] = []
    for index, part in enumerate(loc):
        child = None if node is None else node.child(part)
        if child is not None:
            node = child
            kept.append(part)
        elif index == len(loc) - 1 and part in _known_keys(model, tuple(kept)):
            kept.append(part)
    return tuple(kept)


def _find_misspelt(by_keys: dict[Keys, list[Any]], model: type[BaseModel]) -> set[Keys]:
    """Return the missing keys that are present but misspelt."""
    misspelt = {}
    for keys, errors in by_keys.items():
        if errors[0]["type"] == "extra_forbidden":
            close = _nearest(str(keys[-1]), _known_keys(model, keys[:-1]))
            misspelt.update({(*keys[:-1], near): keys for near in close})
    return {keys for keys, errors in by_keys.items() if errors[0]["type"] == "missing"} & set(
        misspelt
    )


def _sentence(errors: list[Any], node: Node | None, model: type[BaseModel], keys: Keys) -> str:
    kind = errors[0]["type"]
    if kind == "extra_forbidden":
        return _unknown_key(str(keys[-1]), _known_keys(model, keys[:-1]))
    if kind == "missing" and node is None:
        return MISSING
    if node is None:
        return _own_message(errors[0])
    if kind in ("missing", "too_long") and isinstance(node.value, tuple):
        wanted = _length(_annotation(model, keys))
        items = "a different number of" if wanted is None else wanted
        return f"should have {items} items, not {len(node.value)}"
    choices = [_WORDS.get(one["type"], "") for one in errors]
    if not all(choices):
        return _own_message(errors[0])
    expected = dict.fromkeys(
        words.format_map(one.get("ctx", {})) for words, one in zip(choices, errors, strict=True)
    )
    sentence = f"should be {' or '.join(expected)}, not {_format_node(node)}"
    return sentence + _hint(kind, node, errors)


def _own_message(error: Any) -> str:
    message = str(error["msg"]).removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return message.replace("Input should", "should")


def _hint(kind: str, node: Node, errors: list[Any]) -> str:
    if kind == "string_type" and isinstance(node.value, int | float):
        return f'; write it in quotes: "{_format_node(node)}"'
    known = [part for one in errors for part in str(one.get("ctx", {}).get("expected")).split("'")]
    near = _nearest(node.value, known) if isinstance(node.value, str) else []
    return f"; did you mean {near[0]!r}?" if near else ""


def _format_node(node: Node) -> str:
    value = node.value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, tuple):
        return "a list"
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 1] + "…"


def _unknown_key(key: str, known: list[str]) -> str:
    near = _nearest(key, known)
    if near:
        return f"unknown key; did you mean {near[0]!r}?"
    return f"unknown key; known keys are {', '.join(known)}" if known else "unknown key"


def _nearest(word: str, known: Iterable[str]) -> list[str]:
    return get_close_matches(word, list(known), 1, 0.6)


def _known_keys(model: type[BaseModel], keys: Keys) -> list[str]:
    """Return the keys of the mapping at a path, as written in YAML."""
    section = _model_in(_annotation(model, keys))
    return [] if section is None else list(_fields(section))


def _fields(model: type[BaseModel]) -> dict[str, Any]:
    return {field.alias or name: field.annotation for name, field in model.model_fields.items()}


def _annotation(model: type[BaseModel], keys: Keys) -> Any:
    """Return the declared type at a path; None if it is not declared."""
    current: Any = model
    for part in keys:
        current = _inner(current, part)
    return current


def _inner(annotation: Any, part: str | int) -> Any:
    inner = (_inner_of_one(option, part) for option in parts(annotation).members)
    return next((found for found in inner if found is not None), None)


def _inner_of_one(kind: Any, part: str | int) -> Any:
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return _fields(kind).get(str(part))
    origin, args = get_origin(kind), get_args(kind)
    if origin is dict:
        return args[1]
    if origin is tuple and isinstance(part, int) and args[-1] is not Ellipsis:
        return args[part] if part < len(args) else None
    return args[0] if origin is not None and args and isinstance(part, int) else None


def _model_in(annotation: Any) -> type[BaseModel] | None:
    options = parts(annotation).members
    return next((o for o in options if isinstance(o, type) and issubclass(o, BaseModel)), None)


def _length(annotation: Any) -> int | None:
    """Return the length of a list of fixed length."""
    for option in parts(annotation).members:
        args = get_args(option)
        if get_origin(option) is tuple and args and args[-1] is not Ellipsis:
            return len(args)
    return None
