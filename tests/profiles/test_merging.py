"""Laying one profile over another, as laws of a pure function."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.errors import Place
from tactile_core.profiles.merging import merge, without_nulls
from tactile_core.profiles.nodes import Node

law = settings(deadline=None)
BASE, TOP = Place(Path("base.yaml"), 1, 1), Place(Path("top.yaml"), 2, 3)

scalars = st.none() | st.booleans() | st.integers() | st.text(max_size=3)
values = st.recursive(
    scalars | st.lists(scalars, max_size=2),
    lambda inner: st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
    max_leaves=8,
)
trees = st.dictionaries(st.sampled_from(["a", "b", "use", "gel", "shape"]), values, max_size=4)
# Small letters hold numbers, capitals hold mappings: no key changes between the two.
alike = st.recursive(
    st.dictionaries(st.sampled_from("ab"), st.integers(), max_size=2),
    lambda inner: st.dictionaries(st.sampled_from("AB"), inner, max_size=2),
    max_leaves=6,
)


def merged(*trees: dict[str, Any]) -> dict[str, Any]:
    node = Node.of(trees[0], BASE)
    for tree in trees[1:]:
        node = merge(node, Node.of(tree, TOP))
    plain: dict[str, Any] = node.plain()
    return plain


def settled(tree: dict[str, Any]) -> dict[str, Any]:
    plain: dict[str, Any] = without_nulls(Node.of(tree, BASE)).plain()
    return plain


@law
@given(trees)
def test_nothing_laid_over_a_profile_changes_nothing(tree: dict[str, Any]) -> None:
    assert merged(tree, {}) == tree
    assert merged({}, tree) == tree


@law
@given(trees)
def test_a_profile_laid_over_itself_is_itself(tree: dict[str, Any]) -> None:
    assert merged(tree, tree) == tree


@law
@given(trees, trees)
def test_laying_the_same_over_it_twice_is_once(base: dict[str, Any], top: dict[str, Any]) -> None:
    assert merged(base, top, top) == merged(base, top)


@law
@given(alike, alike, alike)
def test_revisions_of_a_kind_may_be_merged_in_any_grouping(
    a: dict[str, Any], b: dict[str, Any], c: dict[str, Any]
) -> None:
    assert merged(merged(a, b), c) == merged(a, merged(b, c))


@law
@given(trees, trees)
def test_what_the_top_says_stands(base: dict[str, Any], top: dict[str, Any]) -> None:
    def said(part: Any, whole: Any) -> bool:
        if isinstance(part, dict) and isinstance(whole, dict):
            return all(key in whole and said(value, whole[key]) for key, value in part.items())
        return bool(part == whole)

    assert said(top, merged(base, top))


@law
@given(trees, st.sampled_from(["a", "b", "gel"]))
def test_null_takes_a_key_back(base: dict[str, Any], key: str) -> None:
    assert key not in settled(merged(base, {key: None}))


@law
@given(trees, trees)
def test_the_order_of_the_base_is_kept(base: dict[str, Any], top: dict[str, Any]) -> None:
    top = {key: value for key, value in top.items() if key != "use"}
    assert list(merged(base, top))[: len(base)] == list(base)


@law
@given(trees, trees)
def test_every_value_stands_in_one_of_the_two_files(
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

    below, above = Node.of(base, BASE), Node.of(top, TOP)
    check(merge(below, above), below, above)


def test_another_component_takes_nothing_over() -> None:
    base = {"camera": {"use": "core.replay", "path": "in", "loop": True}}
    assert merged(base, {"camera": {"use": "lab.usb", "path": "0"}}) == {
        "camera": {"use": "lab.usb", "path": "0"}
    }


def test_the_same_component_keeps_its_options() -> None:
    base = {"camera": {"use": "core.replay", "path": "in"}}
    top = {"camera": {"use": "core.replay", "loop": True}}
    assert merged(base, top) == {"camera": {"use": "core.replay", "path": "in", "loop": True}}


def test_another_shape_drops_what_only_the_old_one_knows() -> None:
    base = {"gel": {"shape": "dome", "radius_mm": 20, "thickness_mm": 2}}
    assert merged(base, {"gel": {"shape": "flat"}}) == {"gel": {"shape": "flat", "thickness_mm": 2}}
    assert settled(merged(base, {"gel": {"shape": None}})) == {"gel": {"thickness_mm": 2}}
    assert merged(base, {"gel": {"thickness_mm": 3}})["gel"]["radius_mm"] == 20


def test_a_component_may_have_a_shape_of_its_own() -> None:
    base = {"camera": {"use": "lab.card", "shape": {"radius_mm": 1}, "radius_mm": 3}}
    top = {"camera": {"shape": {"radius_mm": 2}}}
    assert merged(base, top)["camera"] == {
        "use": "lab.card",
        "shape": {"radius_mm": 2},
        "radius_mm": 3,
    }


def test_a_removed_step_that_comes_back_comes_back_bare() -> None:
    base = {"estimators": {"height": {"use": "core.poisson", "boundary": "dirichlet"}}}
    removed = {"estimators": {"height": None}}
    again = {"estimators": {"height": {"use": "core.poisson"}}}
    assert merged(base, removed, again) == again
