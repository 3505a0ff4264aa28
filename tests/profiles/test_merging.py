"""Algebraic properties of merging one profile into another."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.errors import Place
from tactile_core.formats.yaml_tree import Node
from tactile_core.profiles.source import merge, without_nulls

law = settings(deadline=None)
BASE, TOP = Place(Path("base.yaml"), 1, 1), Place(Path("top.yaml"), 2, 3)

scalars = st.none() | st.booleans() | st.integers() | st.text(max_size=3)
values = st.recursive(
    scalars | st.lists(scalars, max_size=2),
    lambda inner: st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
    max_leaves=8,
)
trees = st.dictionaries(st.sampled_from(["a", "b", "use", "gel", "shape"]), values, max_size=4)
# Lower-case keys have numbers and upper-case keys have mappings, so no key changes its type.
consistent_trees = st.recursive(
    st.dictionaries(st.sampled_from("ab"), st.integers(), max_size=2),
    lambda inner: st.dictionaries(st.sampled_from("AB"), inner, max_size=2),
    max_leaves=6,
)


def merged(*trees: dict[str, Any]) -> dict[str, Any]:
    node = Node.from_plain(trees[0], BASE)
    for tree in trees[1:]:
        node = merge(node, Node.from_plain(tree, TOP))
    plain: dict[str, Any] = node.plain()
    return plain


def nulls_removed(tree: dict[str, Any]) -> dict[str, Any]:
    plain: dict[str, Any] = without_nulls(Node.from_plain(tree, BASE)).plain()
    return plain


@law
@given(trees)
def test_the_empty_profile_is_neutral(tree: dict[str, Any]) -> None:
    assert merged(tree, {}) == tree
    assert merged({}, tree) == tree


@law
@given(trees)
def test_merging_is_idempotent(tree: dict[str, Any]) -> None:
    assert merged(tree, tree) == tree


@law
@given(trees, trees)
def test_merging_the_same_twice_equals_merging_once(
    base: dict[str, Any], top: dict[str, Any]
) -> None:
    assert merged(base, top, top) == merged(base, top)


@law
@given(consistent_trees, consistent_trees, consistent_trees)
def test_merging_is_associative(a: dict[str, Any], b: dict[str, Any], c: dict[str, Any]) -> None:
    assert merged(merged(a, b), c) == merged(a, merged(b, c))


@law
@given(trees, trees)
def test_values_of_the_upper_profile_take_precedence(
    base: dict[str, Any], top: dict[str, Any]
) -> None:
    def contained(part: Any, tree: Any) -> bool:
        if isinstance(part, dict) and isinstance(tree, dict):
            return all(key in tree and contained(value, tree[key]) for key, value in part.items())
        return bool(part == tree)

    assert contained(top, merged(base, top))


@law
@given(trees, st.sampled_from(["a", "b", "gel"]))
def test_null_removes_a_key(base: dict[str, Any], key: str) -> None:
    assert key not in nulls_removed(merged(base, {key: None}))


@law
@given(trees, trees)
def test_the_order_of_the_base_is_kept(base: dict[str, Any], top: dict[str, Any]) -> None:
    top = {key: value for key, value in top.items() if key != "use"}
    assert list(merged(base, top))[: len(base)] == list(base)


@law
@given(trees, trees)
def test_every_value_keeps_the_position_of_its_file(
    base: dict[str, Any], top: dict[str, Any]
) -> None:
    def check(node: Node, below: Node | None, above: Node | None) -> None:
        if above is None:
            assert node is below
            return
        assert node.place == TOP
        if node.is_mapping:
            for key, inner in node.value.items():
                check(inner, below.get(key) if below else None, above.get(key))

    below, above = Node.from_plain(base, BASE), Node.from_plain(top, TOP)
    check(merge(below, above), below, above)


def test_another_component_inherits_no_options() -> None:
    base = {"camera": {"use": "core.replay", "path": "in", "loop": True}}
    assert merged(base, {"camera": {"use": "lab.usb", "path": "0"}}) == {
        "camera": {"use": "lab.usb", "path": "0"}
    }


def test_the_same_component_keeps_its_options() -> None:
    base = {"camera": {"use": "core.replay", "path": "in"}}
    top = {"camera": {"use": "core.replay", "loop": True}}
    assert merged(base, top) == {"camera": {"use": "core.replay", "path": "in", "loop": True}}


def test_another_shape_drops_the_keys_of_the_old_one() -> None:
    base = {"gel": {"shape": "dome", "radius_mm": 20, "thickness_mm": 2}}
    assert merged(base, {"gel": {"shape": "flat"}}) == {"gel": {"shape": "flat", "thickness_mm": 2}}
    assert nulls_removed(merged(base, {"gel": {"shape": None}})) == {"gel": {"thickness_mm": 2}}
    assert merged(base, {"gel": {"thickness_mm": 3}})["gel"]["radius_mm"] == 20


def test_an_option_named_shape_does_not_drop_other_options() -> None:
    base = {"camera": {"use": "lab.card", "shape": {"radius_mm": 1}, "radius_mm": 3}}
    top = {"camera": {"shape": {"radius_mm": 2}}}
    assert merged(base, top)["camera"] == {
        "use": "lab.card",
        "shape": {"radius_mm": 2},
        "radius_mm": 3,
    }


def test_a_removed_and_restored_step_has_no_inherited_options() -> None:
    base = {"estimators": {"height": {"use": "core.poisson", "boundary": "dirichlet"}}}
    removed = {"estimators": {"height": None}}
    again = {"estimators": {"height": {"use": "core.poisson"}}}
    assert merged(base, removed, again) == again
