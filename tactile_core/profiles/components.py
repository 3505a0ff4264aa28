"""Stage two of validation: each component checks its options with its own ``Options`` model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError, create_model

from tactile_core.algorithms.arrays.types import parts
from tactile_core.errors import InputError, PluginError, PluginFault, Problem
from tactile_core.formats.files import expand_home
from tactile_core.formats.yaml_tree import Keys, Node, problem_at
from tactile_core.plugins.blame import blame
from tactile_core.profiles.source import Source

if TYPE_CHECKING:
    from tactile_core.plugins.registry import ComponentKind


# Keys at which a profile names a single component.
_PLACES: Mapping[Keys, ComponentKind] = {
    ("camera",): "camera",
    ("illumination",): "illumination",
    ("illumination", "driver"): "light_driver",
    ("calibration",): "calibrator",
}

# Keys of a component that are themselves components, not options.
_COMPONENTS_WITHIN: Mapping[ComponentKind, tuple[str, ...]] = {"illumination": ("driver",)}


@dataclass(frozen=True)
class Checked:
    """Result of stage two.

    Attributes
    ----------
    problems : tuple of Problem
    settings : dict
        The profile as plain values, with absolute paths.
    """

    problems: tuple[Problem, ...]
    settings: dict[str, Any]


def check_components(source: Source) -> Checked:
    """Import each component with a well-formed name and check its options.

    Other mistakes in the profile are ignored here. A component that cannot be imported is a
    problem at its ``use``. Options declared as :class:`pathlib.Path` are relative to the file that
    contains them.
    """
    tree = source.settings
    settings: dict[str, Any] = tree.plain()
    problems = []
    for keys, kind, node in _find_components(tree):
        use = node.value["use"]
        try:
            part = _component(kind, use.value)
            model: type[BaseModel] = part.Options
        except PluginError as error:
            problems.append(problem_at(use.place, (*keys, "use"), str(error)))
            continue
        if kind == "estimator" and _lacks_markers(source, use, part):
            problems.append(
                problem_at(
                    use.place,
                    (*keys, "use"),
                    f"{use.value} needs printed markers, but the profile has no 'gel.markers'; "
                    f"set their pitch and diameter (or auto), or remove the step",
                )
            )
        given = node.remove_keys("use", *_COMPONENTS_WITHIN.get(kind, ()))
        for key in _replaced_selectors(source, part, given):
            given = given.remove_keys(key)
            del _settings_at(settings, keys)[key]
        found = []
        try:
            options = {
                key: _with_paths(value, _declared_type(model, key))
                for key, value in given.value.items()
            }
            mistakes = _mistakes(part, use.value, options)
        except PluginFault as error:
            problems.append(problem_at(use.place, (*keys, "use"), str(error)))
            continue
        except InputError as error:
            found = [problem_at(node.place, keys, str(error))]
        else:
            if mistakes is not None:
                from tactile_core.profiles.problems import problems_of  # for mistakes alone

                found = problems_of(mistakes, tree, _with_components(kind, model), keys)
            _settings_at(settings, keys).update(options)
        problems += found
    start = tree.get("starting_bundle")
    if start is not None:
        settings["starting_bundle"] = _with_paths(start, Path)
    return Checked(tuple(problems), settings)


def _find_components(tree: Node) -> Iterator[tuple[Keys, ComponentKind, Node]]:
    for keys, kind in _PLACES.items():
        node = tree.node_at(keys)
        if node is not None and _names_a_component(node):
            yield keys, kind, node
    several: tuple[tuple[str, ComponentKind], ...] = (
        ("estimators", "estimator"),
        ("sinks", "sink"),
    )
    for key, kind in several:
        named = tree.get(key)
        if named is not None and named.is_mapping:
            for name, node in named.value.items():
                if _names_a_component(node):
                    yield (key, name), kind, node


def _names_a_component(node: Node | None) -> bool:
    use = None if node is None else node.get("use")
    # stage one reports any other name
    return use is not None and isinstance(use.value, str) and "." in use.value.strip(".")


def _component(kind: ComponentKind, use: str) -> Any:
    from tactile_core.plugins.registry import resolve

    return resolve(kind, use)


def _mistakes(part: Any, use: str, options: dict[str, Any]) -> ValidationError | None:
    """Validate options with the component's ``Options``; return the errors, or None."""
    with blame(f"the options of {use}", part):
        try:
            part.Options.model_validate(options)
        except ValidationError as error:
            return error
    return None


def _with_components(kind: ComponentKind, model: type[BaseModel]) -> type[BaseModel]:
    """Return a component's ``Options`` extended by its nested components' keys."""
    within: dict[str, Any] = dict.fromkeys(_COMPONENTS_WITHIN.get(kind, ()), (Any, None))
    return create_model(model.__name__, __base__=model, **within) if within else model


def _lacks_markers(source: Source, use: Node, part: Any) -> bool:
    """Whether a step needs markers that the gel lacks; inherited steps are skipped instead."""
    if not getattr(part, "needs_markers", False):
        return False
    markers: Keys = ("gel", "markers")
    if source.settings.node_at(markers) is not None:
        return False
    return not source.inherits(use.place, source.origin(*markers))


def _replaced_selectors(source: Source, part: Any, given: Node) -> list[str]:
    """Return what selects the device of an older profile, where a newer one selects its own."""
    selectors = {
        key: given.value[key].place for key in getattr(part, "selectors", ()) if key in given.value
    }
    return [
        key
        for key, place in selectors.items()
        if any(source.inherits(place, other) for other in selectors.values())
    ]


def _declared_type(model: type[BaseModel], key: str) -> Any:
    field = model.model_fields.get(key)
    return None if field is None else field.annotation


def _with_paths(node: Node, annotation: Any) -> Any:
    """Return plain values in which options declared as paths are absolute."""
    if isinstance(node.value, tuple):
        args = next((found for one in parts(annotation).members if (found := get_args(one))), ())
        return [_with_paths(item, args[0] if args else None) for item in node.value]
    if isinstance(node.value, str) and _is_path(annotation, node.value):
        return str(node.place.file.parent.resolve() / expand_home(node.value))
    return node.plain()


def _is_path(annotation: Any, text: str) -> bool:
    options = parts(annotation).members
    words = [word for o in options if get_origin(o) is Literal for word in get_args(o)]
    paths = [o for o in options if isinstance(o, type) and issubclass(o, Path)]
    return bool(paths) and text not in words


def _settings_at(settings: dict[str, Any], keys: Keys) -> dict[str, Any]:
    for key in keys:
        settings = settings[str(key)]
    return settings
