"""Stage two: the parts that a profile names, each checked by its own ``Options``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from tactile_core.errors import PluginError
from tactile_core.profiles.problems import problems_of
from tactile_core.profiles.source import Node, Problem

if TYPE_CHECKING:
    from tactile_core.plugins import Kind

Found = tuple[tuple[str, ...], "Kind", Node]


def part_problems(tree: Node) -> list[Problem]:
    """Check each part that is named soundly, whatever else is wrong with the profile."""
    problems = []
    for path, kind, node in _parts(tree):
        options = _options_of(kind, node)
        if isinstance(options, PluginError):
            use = node.value["use"]
            problems.append(Problem(use.place, f"{'.'.join(path)}.use", str(options)))
            continue
        try:
            options.model_validate(_options(node, options))
        except ValidationError as error:
            problems += problems_of(error, tree, options, path)
    return problems


def with_absolute_paths(tree: Node) -> dict[str, Any]:
    """Plain values, with the parts' paths relative to the file that declares them made absolute."""
    plain: dict[str, Any] = tree.plain()
    for path, kind, node in _parts(tree):
        options = _options_of(kind, node)
        if not isinstance(options, PluginError):
            target = plain
            for part in path:
                target = target[part]
            target.update(_options(node, options))
    return plain


def _parts(tree: Node) -> Iterator[Found]:
    kinds: tuple[Kind, ...] = ("camera", "illumination", "calibration")
    for kind in kinds:
        node = tree.get(kind)
        if node is not None and _names_a_part(node):
            yield (kind,), kind, node
    steps = tree.get("estimators")
    if steps is not None and isinstance(steps.value, dict):
        for name, node in steps.value.items():
            if _names_a_part(node):
                yield ("estimators", name), "estimator", node


def _names_a_part(node: Node) -> bool:
    use = node.get("use")
    return use is not None and isinstance(use.value, str) and "." in use.value


def _options_of(kind: Kind, node: Node) -> type[BaseModel] | PluginError:
    from tactile_core.plugins import resolve

    try:
        options: type[BaseModel] = resolve(kind, node.value["use"].value).Options
    except PluginError as error:
        return error
    return options


def _options(node: Node, model: type[BaseModel]) -> dict[str, Any]:
    options = {}
    for key, value in node.value.items():
        if key == "use":
            continue
        plain = value.plain()
        field = model.model_fields.get(key)
        if field is not None and isinstance(plain, str) and _is_path(field.annotation):
            plain = str(value.place.file.parent.resolve() / plain)
        options[key] = plain
    return options


def _is_path(annotation: Any) -> bool:
    if get_origin(annotation) in (Union, UnionType):
        return any(_is_path(option) for option in get_args(annotation))
    return isinstance(annotation, type) and issubclass(annotation, Path)
