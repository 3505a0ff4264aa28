"""YAML files as trees of nodes that know their line."""

from __future__ import annotations

import math
import re
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError, Place, Problem, ProfileError
from tactile_core.formats.files import read_text
from tactile_core.formats.text import printable

Keys = tuple[str | int, ...]  # A path in the tree: the keys of mappings and the indices of lists


def problem_at(place: Place, keys: Keys, message: str) -> Problem:
    """Make a problem of the value at ``keys``."""
    key = printable(".".join(str(key)[:60] for key in keys))
    return Problem(place.file, place.line, place.column, key, message)


@dataclass(frozen=True)
class Node:
    """A value and its position in a file; for a mapping's value, the position of its key.

    Attributes
    ----------
    value : scalar, tuple of Node, or dict of str to Node
        Treat as immutable.
    place : Place
    """

    value: Any
    place: Place

    @classmethod
    def from_plain(cls, value: Any, place: Place) -> Node:
        """Make a tree from plain mappings, lists and scalars that share one position."""
        if isinstance(value, Mapping):
            return cls(
                {str(key): cls.from_plain(item, place) for key, item in value.items()}, place
            )
        if isinstance(value, list | tuple):
            return cls(tuple(cls.from_plain(item, place) for item in value), place)
        return cls(value, place)

    @property
    def is_mapping(self) -> bool:
        """Whether the value is a mapping."""
        return isinstance(self.value, dict)

    def get(self, key: str) -> Node | None:
        """Return the value of a key; None if the node is not a mapping or lacks the key."""
        return self.value.get(key) if isinstance(self.value, dict) else None

    def child(self, part: str | int) -> Node | None:
        """Return the value of a key or the item at an index; None if it does not exist."""
        if isinstance(self.value, tuple) and isinstance(part, int):
            return self.value[part] if part < len(self.value) else None
        return self.get(str(part))

    def node_at(self, keys: Keys) -> Node | None:
        """Return the value at a path; None if it does not exist."""
        node: Node | None = self
        for part in keys:
            node = None if node is None else node.child(part)
        return node

    def origin(self, keys: Keys) -> Place:
        """Return the position of the deepest existing part of a path."""
        node = self
        for part in keys:
            child = node.child(part)
            if child is None:
                break
            node = child
        return node.place

    def remove_keys(self, *keys: str) -> Node:
        """Return the mapping without some keys."""
        return Node({k: v for k, v in self.value.items() if k not in keys}, self.place)

    def plain(self) -> Any:
        """Return plain dicts, lists and scalars."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, tuple):
            return [node.plain() for node in self.value]
        return self.value


# Largest accepted profile; a long one has a few thousand bytes, and this many parse in 1 s.
MOST_BYTES = 200_000
# Largest other file; a scan with a thousand drawn circles has a tenth of this size.
MAX_BYTES = 1_000_000
DEEPEST = 50  # Deepest accepted nesting

_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_BASED = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), float("inf")),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), float("-inf")),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}


def read_yaml(path: Path) -> tuple[Node, list[Problem]]:
    """Read a profile: a file whose top is a mapping.

    Returns
    -------
    tree : Node
    problems : list of Problem
        Mistakes that do not prevent reading: repeated keys, merge keys, anchors, tags,
        numbers that are not finite.

    Raises
    ------
    ProfileError
        The file cannot be read: it is missing, too large, not UTF-8, not YAML, not a single
        mapping, or uses aliases.
    """
    return _parse(_text(path), path)


def read_mapping(path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML file that is no profile.

    Raises
    ------
    InputError
        The file is missing, too large, not text, not YAML (with line and column), nested too
        deeply or not a mapping, or uses repeated keys, aliases, tags or numbers
        that are not finite.
    """
    path = Path(path)
    return mapping_of(read_text(path, MAX_BYTES), path)


def mapping_of(text: str, path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML text; ``path`` says in messages where it comes from.

    Raises
    ------
    InputError
        As :func:`read_mapping`.
    """
    try:
        tree, problems = _parse(text, path)
    except ProfileError as error:
        problems = [*error.problems]
    if problems:
        raise InputError(f"this YAML cannot be read: {problems[0]}")
    found: dict[str, Any] = tree.plain()
    return found


def _parse(text: str, path: Path) -> tuple[Node, list[Problem]]:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError
    from ruamel.yaml.reader import ReaderError

    try:
        builder = _Builder(path, iter(YAML(typ="safe", pure=True).parse(text)))
        tree = builder.document()
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(path, mark.line + 1, mark.column + 1) if mark else Place(path)
        problem = problem_at(place, (), _message(error))
    except ReaderError as error:
        before = text[: error.position].splitlines() or [""]
        place = Place(path, len(before), len(before[-1]) + 1)
        problem = problem_at(place, (), "not YAML: control character")
    except _StopReadingError as stop:
        problem = stop.problem
    else:
        if tree.is_mapping:
            return tree, builder.problems
        problem = problem_at(tree.place, (), "the file must be a mapping of keys to values")
    raise refusal([*builder.problems, problem])


def refusal(problems: list[Problem]) -> ProfileError:
    """Make one error that reports all problems, sorted by file and line."""
    ordered = sorted(set(problems), key=lambda p: (str(p.file), p.line, p.column, p.key))
    if len(ordered) == 1:
        return ProfileError(str(ordered[0]), ordered)
    lines = "\n".join(map(str, ordered))
    return ProfileError(f"there are {len(ordered)} problems with the profile:\n{lines}", ordered)


def _text(path: Path) -> str:
    def refused(message: str) -> ProfileError:
        return refusal([problem_at(Place(path), (), message)])

    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise refused("cannot be read (a folder, a pipe or a device); name a YAML file")
        if status.st_size > MOST_BYTES:
            raise refused("too large for a profile; is this the right file?")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise refused("there is no such file; 'tactile profiles' lists names") from None
    except UnicodeDecodeError:
        raise refused("not text in UTF-8; is this the right file?") from None
    except OSError as error:
        raise refused(f"cannot be read ({error.strerror})") from error
    except ValueError as error:  # NUL in the name
        raise refused(f"not a valid file name ({error})") from error


def _message(error: Any) -> str:
    message = str(error.problem or error.context)
    if "'\\t'" in message:
        return "not YAML: indented with a tab; use spaces"
    if error.problem and error.context and error.context_mark:
        message += f" {error.context} that begins on line {error.context_mark.line + 1}"
    return f"not YAML: {message}"


class _StopReadingError(Exception):
    """The rest of the file cannot be parsed."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(str(problem))
        self.problem = problem


class _Builder:
    """Builds the tree from parser events and reports the YAML features that are not used here."""

    def __init__(self, path: Path, events: Iterator[Any]) -> None:
        self._path, self._events = path, events
        self._anchor: Problem | None = None
        self.problems: list[Problem] = []

    def document(self) -> Node:
        event = self._next()
        while (kind := type(event).__name__) in ("StreamStartEvent", "DocumentStartEvent"):
            if getattr(event, "version", None) not in (None, (1, 2)):
                self._note(self._place(event), (), "the file must be YAML 1.2; remove '%YAML'")
            event = self._next()
        if kind == "StreamEndEvent":
            return Node({}, Place(self._path, 1, 1))
        node = self._node(event, (), self._place(event))
        self._next()  # the document's end
        after = self._next()
        if type(after).__name__ != "StreamEndEvent":
            raise self._stop(after, (), "the file must be one document; remove '---'")
        return node

    def _node(self, event: Any, keys: Keys, place: Place) -> Node:
        kind = type(event).__name__
        if getattr(event, "anchor", None) is not None and self._anchor is None:
            message = (
                "anchors and aliases are not used here; write the value (a profile can use "
                "'extends')"
            )
            self._anchor = problem_at(place, keys, message)
            self.problems.append(self._anchor)
        if kind == "AliasEvent" and self._anchor is not None:
            raise _StopReadingError(self._anchor)
        if getattr(event, "tag", None) is not None:
            self._note(place, keys, "tags (!…) are not used here")
        if len(keys) > DEEPEST:
            raise self._stop(event, keys[:2], "nested too deeply")
        if kind == "SequenceStartEvent":
            items: list[Node] = []
            while type(item := self._next()).__name__ != "SequenceEndEvent":
                items.append(self._node(item, (*keys, len(items)), self._place(item)))
            return Node(tuple(items), place)
        if kind == "MappingStartEvent":
            return Node(self._mapping(keys), place)
        value = scalar(event.value) if event.implicit[0] else event.value
        if isinstance(value, float) and not math.isfinite(value):
            self._note(place, keys, f"should be a finite number, not {value}")
        return Node(value, place)

    def _mapping(self, keys: Keys) -> dict[str, Node]:
        mapping: dict[str, Node] = {}
        while type(event := self._next()).__name__ != "MappingEndEvent":
            if type(event).__name__ != "ScalarEvent":
                raise self._stop(event, keys, "a key must be a plain word")
            key, place = str(event.value), self._place(event)
            here = (*keys, key)
            value = self._node(self._next(), here, place)
            if key == "<<":
                self._note(place, here, "merge keys are not used here; write the keys")
            elif key in mapping:
                first = mapping[key].place.line
                self._note(place, here, f"repeated key; the first is on line {first}")
            else:
                mapping[key] = value
        return mapping

    def _next(self) -> Any:
        return next(self._events)

    def _place(self, event: Any) -> Place:
        return Place(self._path, event.start_mark.line + 1, event.start_mark.column + 1)

    def _note(self, place: Place, keys: Keys, message: str) -> None:
        self.problems.append(problem_at(place, keys, message))

    def _stop(self, event: Any, keys: Keys, message: str) -> _StopReadingError:
        return _StopReadingError(problem_at(self._place(event), keys, message))


def scalar(text: str) -> Any:
    """Return the value of an unquoted scalar by the core schema of YAML 1.2.

    An integer with a leading 0 stays text: it is a serial number or a USB id.
    """
    if text in _WORDS:
        return _WORDS[text]
    if len(text) > 100:  # [digits] Python limits conversions of long integers
        return text
    if _INTEGER.fullmatch(text):
        return int(text)
    if _BASED.fullmatch(text):
        return int(text, 0)
    return float(text) if _FLOAT.fullmatch(text) else text
