"""The YAML files of a profile, merged into one tree."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from tactile_core.errors import Place, ProfileError
from tactile_core.errors import Problem as Problem
from tactile_core.formats.yaml_tree import Keys, Node, problem_at, read_yaml

# Keys of `gel` that belong to one shape only.
_KEYS_OF_A_SHAPE: Mapping[str, frozenset[str]] = {"dome": frozenset({"radius_mm"})}

# Keys that survive a change of `use`, because they are components themselves.
_KEPT: Mapping[Keys, frozenset[str]] = {("illumination",): frozenset({"driver"})}


def merge(base: Node, top: Node) -> Node:
    """Merge ``top`` into ``base``.

    Mappings merge key by key and keep the order of ``base``; lists and scalars replace. A changed
    ``use`` replaces the whole component, except an illumination's driver. A changed ``gel.shape``
    drops the keys that belong to the old shape only. ``null`` stays in the tree, so that it also
    resets keys of older profiles; see :func:`without_nulls`. Each value keeps its position.

    Parameters
    ----------
    base, top : Node
        Complete profiles; ``top`` may also be an overlay. Merge a chain of profiles from the
        oldest to the newest: the order matters, because a changed ``use`` and ``null`` discard
        older values.
    """
    return _merge_nodes(base, top, ())


def without_nulls(node: Node) -> Node:
    """Drop keys whose value is null, which stands for the default or for a removed step."""
    if isinstance(node.value, dict):
        kept = {k: without_nulls(v) for k, v in node.value.items() if v.value is not None}
        return Node(kept, node.place)
    if isinstance(node.value, tuple):
        return Node(tuple(without_nulls(item) for item in node.value), node.place)
    return node


def _merge_nodes(base: Node, top: Node, keys: Keys) -> Node:
    if not (base.is_mapping and top.is_mapping):
        return top
    below = {
        key: node for key, node in base.value.items() if key not in _find_dropped(base, top, keys)
    }
    merged = {}
    for key, node in below.items():
        above = top.get(key)
        merged[key] = node if above is None else _merge_nodes(node, above, (*keys, key))
    merged.update({key: node for key, node in top.value.items() if key not in below})
    return Node(merged, top.place)


def _find_dropped(base: Node, top: Node, keys: Keys) -> frozenset[str]:
    """Return the keys of ``base`` that do not apply to the variant chosen in ``top``."""
    if _has_changed(base, top, "use"):
        return frozenset(base.value) - _KEPT.get(keys, frozenset())
    if keys == ("gel",) and _has_changed(base, top, "shape"):
        return _KEYS_OF_A_SHAPE.get(str(base.value["shape"].value), frozenset())
    return frozenset()


def _has_changed(base: Node, top: Node, key: str) -> bool:
    old, new = base.get(key), top.get(key)
    return old is not None and new is not None and old.value != new.value


DEEPEST = 20  # Longest chain of profiles that extend each other

# Returns the file that `extends` names, given the name and its position. Raises ProfileError if
# there is none.
Find = Callable[[str, Place], Path]


@dataclass(frozen=True)
class Source:
    """A profile before validation.

    Attributes
    ----------
    tree : Node
        Merged; each value has its file, line and column, and ``null`` is kept.
    problems : tuple of Problem
        Mistakes found while reading.
    lineage : tuple of Path
        The files that it was merged from, oldest first.
    whole : bool
        False if a file that it extends could not be read, so that missing keys are no mistake.
    """

    tree: Node
    problems: tuple[Problem, ...] = ()
    whole: bool = True
    lineage: tuple[Path, ...] = ()

    @property
    def settings(self) -> Node:
        """The merged values, without the keys that ``null`` resets."""
        return without_nulls(self.tree)

    def origin(self, *keys: str | int) -> Place:
        """Return the position of the value at a path, or of the deepest existing part."""
        return self.tree.origin(keys)

    def inherits(self, one: Place, other: Place) -> bool:
        """Whether ``one`` is in an older file of the lineage than ``other``."""
        return self._generation(one.file) < self._generation(other.file)

    def _generation(self, file: Path) -> int:
        return self.lineage.index(file) if file in self.lineage else len(self.lineage)

    def merge_overlay(self, overlay: Node) -> Source:
        """Merge a tree into the profile."""
        return replace(self, tree=merge(self.tree, overlay))


def read_source(path: Path, find: Find) -> Source:
    """Read a profile with everything that it extends.

    Parameters
    ----------
    path : Path
    find : callable
        See :data:`Find`.

    Raises
    ------
    ProfileError
        The file itself cannot be parsed. Mistakes in a file that it extends are among the
        problems.
    """
    return _read(path, find, ())


def _read(path: Path, find: Find, below: tuple[Path, ...]) -> Source:
    tree, problems = read_yaml(path)
    extends = tree.get("extends")
    own = Source(tree.remove_keys("extends"), tuple(problems), lineage=(path,))
    if extends is None or extends.value is None:
        return own
    try:
        parent = _parent(extends, find, (*below, path))
        base = _read(parent, find, (*below, path))
    except ProfileError as error:
        return replace(own, problems=(*own.problems, *error.problems), whole=False)
    problems = [*base.problems, *own.problems]
    return Source(merge(base.tree, own.tree), tuple(problems), base.whole, (*base.lineage, path))


def _parent(extends: Node, find: Find, chain: tuple[Path, ...]) -> Path:
    if not isinstance(extends.value, str):
        raise _refuse_parent(extends, "name one profile, or the path of one file")
    if len(chain) > DEEPEST:
        raise _refuse_parent(
            extends,
            f"more than {DEEPEST} profiles extend each other; use fewer files",
        )
    parent = find(extends.value, extends.place)
    if parent.resolve() in [path.resolve() for path in chain]:
        circle = " → ".join(path.name for path in (*chain, parent))
        raise _refuse_parent(extends, f"profiles extend each other in a circle: {circle}")
    return parent


def _refuse_parent(extends: Node, message: str) -> ProfileError:
    keys: Keys = ("extends",)
    problem = problem_at(extends.place, keys, message)
    return ProfileError(str(problem), [problem])
