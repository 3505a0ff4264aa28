"""Merges a profile with the profile that it extends: pure functions of trees."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.profiles.nodes import Keys, Node

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
    return _merged(base, top, ())


def without_nulls(node: Node) -> Node:
    """Drop keys whose value is null, which stands for the default or for a removed step."""
    if isinstance(node.value, dict):
        kept = {k: without_nulls(v) for k, v in node.value.items() if v.value is not None}
        return Node(kept, node.place)
    if isinstance(node.value, tuple):
        return Node(tuple(without_nulls(item) for item in node.value), node.place)
    return node


def _merged(base: Node, top: Node, keys: Keys) -> Node:
    if not (base.is_mapping and top.is_mapping):
        return top
    below = {key: node for key, node in base.value.items() if key not in _dropped(base, top, keys)}
    merged = {}
    for key, node in below.items():
        above = top.get(key)
        merged[key] = node if above is None else _merged(node, above, (*keys, key))
    merged.update({key: node for key, node in top.value.items() if key not in below})
    return Node(merged, top.place)


def _dropped(base: Node, top: Node, keys: Keys) -> frozenset[str]:
    """Return the keys of ``base`` that do not apply to the variant chosen in ``top``."""
    if _changed(base, top, "use"):
        return frozenset(base.value) - _KEPT.get(keys, frozenset())
    if keys == ("gel",) and _changed(base, top, "shape"):
        return _KEYS_OF_A_SHAPE.get(str(base.value["shape"].value), frozenset())
    return frozenset()


def _changed(base: Node, top: Node, key: str) -> bool:
    old, new = base.get(key), top.get(key)
    return old is not None and new is not None and old.value != new.value
