"""From the validator's errors to plain words at the right line."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from tactile_core.profiles.source import Node, Problem

Path = tuple[str | int, ...]


def problems_of(
    error: ValidationError, tree: Node, model: type[BaseModel], prefix: Path = ()
) -> list[Problem]:
    """Say each error of a validation in plain words, once.

    Parameters
    ----------
    error : ValidationError
    tree : Node
        What was validated, with positions.
    model : type
        The model that refused it.
    prefix : tuple of str
        Where in the tree the model's mapping stands.
    """
    found: dict[tuple[Path, str], Problem] = {}
    for one in error.errors(include_url=False):
        path = (*prefix, *_in_file(tree, prefix, one["loc"], one["type"]))
        message = _words(one, model, path[len(prefix) :])
        place = tree.nearest(path)
        found.setdefault((path, ""), Problem(place, ".".join(map(str, path)), message))
    return list(found.values())


def nearest_key(key: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" for the nearest known key, or what there is."""
    names = sorted(known)
    close = get_close_matches(key, names, 1, 0.5)
    return f"; did you mean {close[0]!r}?" if close else f"; known keys are {', '.join(names)}"


def keys_of(model: type[BaseModel]) -> list[str]:
    """Keys of a model as they stand in YAML."""
    return [field.alias or name for name, field in model.model_fields.items()]


def _in_file(tree: Node, prefix: Path, loc: Path, kind: str) -> Path:
    """The parts of a location that are keys, without the names of alternatives."""
    node: Node | None = tree
    for part in prefix:
        node = node.get(str(part)) if node else None
    kept: list[str | int] = []
    for index, part in enumerate(loc):
        child = None if node is None else node.child(part)
        last = index == len(loc) - 1
        if child is not None:
            node = child
        elif not (last and kind == "missing"):
            continue
        kept.append(part)
    return tuple(kept)


def _words(error: Any, model: type[BaseModel], path: Path) -> str:
    kind = error["type"]
    if kind == "extra_forbidden":
        section = _model_at(model, path[:-1])
        known = keys_of(section) if section else []
        return "unknown key" + (nearest_key(str(path[-1]), known) if known else "")
    if kind == "missing":
        return "is missing; add it"
    text = str(error["msg"]).removeprefix("Value error, ").replace("Input should", "should")
    given = error["input"]
    shown = "" if isinstance(given, dict | list) else f", not {given!r}"
    return f"{text}{shown}"


def _model_at(model: type[BaseModel], path: Path) -> type[BaseModel] | None:
    """The model that validates the mapping at a path, if it has fixed keys."""
    current: type[BaseModel] | None = model
    for part in path:
        if current is None:
            return None
        fields = {field.alias or name: field for name, field in current.model_fields.items()}
        field = fields.get(str(part))
        current = None if field is None else _model_in(field.annotation)
    return current


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) in (Union, UnionType):
        found = (_model_in(option) for option in get_args(annotation))
        return next((model for model in found if model is not None), None)
    return None
