"""YAML with positions: every value remembers the file, line and column that it came from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_core.errors import ProfileError

if TYPE_CHECKING:
    from ruamel.yaml.events import Event
    from ruamel.yaml.resolver import BaseResolver

MOST_BYTES = 1_000_000
DEEPEST = 50

_SHAPE_KEYS: Mapping[str, frozenset[str]] = {"dome": frozenset({"radius_mm"})}
"""Keys that only one shape of a gel knows."""


@dataclass(frozen=True)
class Place:
    """Where something stands in a file; lines and columns count from 1."""

    file: Path
    line: int = 1
    column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True)
class Problem:
    """One mistake in a profile."""

    place: Place
    key: str
    message: str

    def __str__(self) -> str:
        return f"{self.place}: {self.key + ': ' if self.key else ''}{self.message}"


@dataclass(frozen=True)
class Node:
    """A YAML value and where it stands (a mapping's value: where its key does).

    Attributes
    ----------
    value : scalar, tuple of Node, or dict of str to Node
    """

    value: Any
    place: Place

    def get(self, key: str) -> Node | None:
        """Return the value of a key; None when this is no mapping or lacks it."""
        return self.value.get(key) if isinstance(self.value, dict) else None

    def plain(self) -> Any:
        """Return ordinary dicts, lists and scalars."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, tuple):
            return [node.plain() for node in self.value]
        return self.value

    def child(self, part: str | int) -> Node | None:
        """Return the value of a key or the item at an index; None when there is none."""
        if isinstance(self.value, tuple) and isinstance(part, int):
            return self.value[part] if part < len(self.value) else None
        return self.get(str(part))

    def nearest(self, path: tuple[str | int, ...]) -> Place:
        """Return the place of the deepest part of a path that stands in the file."""
        node = self
        for part in path:
            # Parts that are not there are names that the validator gives to alternatives.
            node = node.child(part) or node
        return node.place


def merge(base: Node, top: Node) -> Node:
    """Lay one tree over another.

    Mappings merge; lists and scalars replace. A changed ``use`` replaces the whole component, and
    a changed ``shape`` drops what only the old shape knows.
    """
    if not (isinstance(base.value, dict) and isinstance(top.value, dict)):
        return top
    below = dict(base.value)
    if _changed(base, top, "use"):
        below = {}
    elif _changed(base, top, "shape"):
        for key in _SHAPE_KEYS.get(below["shape"].value, ()):
            below.pop(key, None)
    merged = {key: top.value.get(key, node) for key, node in below.items()}
    for key, node in top.value.items():
        merged[key] = merge(below[key], node) if key in below else node
    return Node(merged, top.place)


def without_nulls(node: Node) -> Node:
    """Drop the keys that are null: they mean the default, or a removed step."""
    if not isinstance(node.value, dict):
        return node
    kept = {k: without_nulls(v) for k, v in node.value.items() if v.value is not None}
    return Node(kept, node.place)


def read_merged(path: Path, find: Callable[[str, Place], Path]) -> Node:
    """Read a profile with all that it extends.

    Parameters
    ----------
    path : Path
    find : callable
        Turns what ``extends`` names, and its place, into a path.

    Raises
    ------
    ProfileError
        A file is unreadable or not YAML, or the profiles extend each other in a circle.
    """
    return _read_chain(path, find, ())


def _read_chain(path: Path, find: Callable[[str, Place], Path], above: tuple[Path, ...]) -> Node:
    node = read_yaml(path)
    extends = node.get("extends")
    if extends is None or extends.value is None:
        return Node({k: v for k, v in node.value.items() if k != "extends"}, node.place)
    if not isinstance(extends.value, str):
        raise _error(extends.place, "extends", "name one profile or the path of one file")
    parent = find(extends.value, extends.place)
    chain = (*above, path.resolve())
    if parent.resolve() in chain:
        circle = " → ".join(p.name for p in (*chain, parent))
        raise _error(extends.place, "extends", f"profiles extend each other in a circle: {circle}")
    own = Node({k: v for k, v in node.value.items() if k != "extends"}, node.place)
    return merge(_read_chain(parent, find, chain), own)


def read_yaml(path: Path) -> Node:
    """Read one YAML 1.2 file whose top is a mapping.

    Raises
    ------
    ProfileError
        The file is missing, too large, not UTF-8 or not YAML, repeats a key, or uses anchors,
        aliases, tags or several documents.
    """
    text = _text(path)
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    yaml = YAML(typ="safe", pure=True)
    try:
        events = iter(yaml.parse(text))
        node = _Builder(path, events, yaml.resolver).document()
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(path, mark.line + 1, mark.column + 1) if mark else Place(path)
        raise _error(place, "", f"not YAML: {error.problem or error.context}") from error
    except YAMLError as error:
        raise _error(Place(path), "", f"not YAML: {str(error).splitlines()[0]}") from error
    if not isinstance(node.value, dict):
        raise _error(node.place, "", "a profile is a mapping of keys to values")
    return node


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise _error(Place(path), "", "too large for a profile; is this the right file?")
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ProfileError(
            f"{path}: there is no such file; 'tactile profiles' lists names"
        ) from None
    except UnicodeDecodeError:
        raise _error(Place(path), "", "not text in UTF-8; is this the right file?") from None
    except OSError as error:
        raise ProfileError(f"{path}: cannot be read ({error.strerror})") from error


def _changed(base: Node, top: Node, key: str) -> bool:
    old, new = base.get(key), top.get(key)
    return old is not None and new is not None and old.value != new.value


def _error(place: Place, key: str, message: str) -> ProfileError:
    problem = Problem(place, key, message)
    return ProfileError(str(problem), [problem])


class _Builder:
    """Builds the tree from parser events, so that nothing is expanded behind our back."""

    def __init__(self, path: Path, events: Iterator[Event], resolver: BaseResolver) -> None:
        self._path, self._events, self._resolver = path, events, resolver

    def document(self) -> Node:
        event = next(self._events)
        while type(event).__name__ in ("StreamStartEvent", "DocumentStartEvent"):
            event = next(self._events)
        if type(event).__name__ == "StreamEndEvent":
            return Node({}, Place(self._path))
        node = self._node(event, 0)
        next(self._events)  # the document's end
        after = next(self._events)
        if type(after).__name__ != "StreamEndEvent":
            raise _error(self._place(after), "", "a profile is one document; remove '---'")
        return node

    def _node(self, event: Any, depth: int) -> Node:
        place = self._place(event)
        kind = type(event).__name__
        if kind == "AliasEvent" or getattr(event, "anchor", None) is not None:
            raise _error(place, "", "anchors and aliases are not used in profiles; write the value")
        if depth > DEEPEST:
            raise _error(place, "", "nested too deeply for a profile")
        if kind == "SequenceStartEvent":
            items = []
            while type(item := next(self._events)).__name__ != "SequenceEndEvent":
                items.append(self._node(item, depth + 1))
            return Node(tuple(items), place)
        if kind == "MappingStartEvent":
            return Node(self._mapping(depth), place)
        return Node(self._scalar(event), place)

    def _mapping(self, depth: int) -> dict[str, Node]:
        mapping: dict[str, Node] = {}
        while type(event := next(self._events)).__name__ != "MappingEndEvent":
            place = self._place(event)
            if type(event).__name__ != "ScalarEvent":
                raise _error(place, "", "a key must be a plain word")
            key = str(getattr(event, "value", ""))
            if key == "<<":
                raise _error(place, "<<", "merge keys are not used in profiles; use 'extends'")
            if key in mapping:
                first = mapping[key].place
                raise _error(place, key, f"stands twice; the first is on line {first.line}")
            mapping[key] = Node(self._node(next(self._events), depth + 1).value, place)
        return mapping

    def _scalar(self, event: Any) -> Any:
        from ruamel.yaml.nodes import ScalarNode

        if event.tag is not None:
            raise _error(self._place(event), "", "tags (!…) are not used in profiles")
        tag = str(self._resolver.resolve(ScalarNode, event.value, event.implicit))
        return _converted(tag.rpartition(":")[2], event.value)

    def _place(self, event: Any) -> Place:
        return Place(self._path, event.start_mark.line + 1, event.start_mark.column + 1)


def _converted(kind: str, text: str) -> Any:
    if kind == "null":
        return None
    if kind == "bool":
        return text.lower() == "true"
    try:
        if kind == "int":
            return _integer(text)
        if kind == "float":
            return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    except ValueError:
        return text
    return text


def _integer(text: str) -> int | str:
    # 0123 is a serial or a USB id, not a number.
    digits = text.lstrip("+-")
    if digits.startswith(("0x", "0o")):
        return int(text, 0)
    return text if len(digits) > 1 and digits.startswith("0") else int(text)
