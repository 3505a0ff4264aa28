"""A tree of values that remember their position in a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tactile_core.errors import Place, Problem
from tactile_core.formats.printable import printable

_LONGEST_KEY = 60

Keys = tuple[str | int, ...]  # A path in the tree: the keys of mappings and the indices of lists


def problem_at(place: Place, keys: Keys, message: str) -> Problem:
    """Make a problem of the value at ``keys``."""
    key = printable(".".join(str(key)[:_LONGEST_KEY] for key in keys))
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
    def of(cls, value: Any, place: Place) -> Node:
        """Make a tree from plain mappings, lists and scalars that share one position."""
        if isinstance(value, Mapping):
            return cls({str(key): cls.of(item, place) for key, item in value.items()}, place)
        if isinstance(value, list | tuple):
            return cls(tuple(cls.of(item, place) for item in value), place)
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

    def at(self, keys: Keys) -> Node | None:
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

    def without(self, *keys: str) -> Node:
        """Return the mapping without some keys."""
        return Node({k: v for k, v in self.value.items() if k not in keys}, self.place)

    def plain(self) -> Any:
        """Return plain dicts, lists and scalars."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, tuple):
            return [node.plain() for node in self.value]
        return self.value
