"""A contact solved in a window of the grid equals that of the whole grid."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_sim.contact_state import Move, Pose, SurfaceState
from tactile_sim.contact_step import ContactModel, Precision
from tactile_sim.gel import SoftGel
from tactile_sim.indenters import make_indenter
from tactile_sim.normal_contact import Window

GEL = SoftGel(Elastomer(2.0, 0.145, 0.48))
CAREFUL = Precision(normal=1e-5, friction=1e-4, sweeps=3)


@given(
    part=st.tuples(st.integers(1, 30), st.integers(1, 30)),
    whole=st.tuples(st.integers(31, 50), st.integers(31, 50)),
    seed=st.integers(0, 1000),
)
@settings(max_examples=25, deadline=None)
def test_the_response_of_a_window_equals_that_of_the_whole_layer(
    part: tuple[int, int], whole: tuple[int, int], seed: int
) -> None:
    layer = ElasticLayer(SurfaceGrid(whole[1], whole[0], 0.2), GEL.elastomer, np.float64)
    loads = np.random.default_rng(seed).standard_normal((3, *part))
    everywhere = np.zeros((3, *whole))
    window = Window(slice(1, 1 + part[0]), slice(1, 1 + part[1]))
    window.view_of(everywhere)[...] = loads
    near = layer.near(part)
    answer = near.displacement(loads[:2], loads[2])
    np.testing.assert_allclose(
        answer, window.view_of(layer.displacement(everywhere[:2], everywhere[2])), atol=1e-12
    )
    np.testing.assert_allclose(answer[:2], near.shift(loads[:2]) + near.spread(loads[2]))
    np.testing.assert_allclose(answer[2], near.indentation(loads[2]) + near.bulge(loads[:2]))


def moved(kind: str, options: dict[str, Any], load: dict[str, float]) -> SurfaceState:
    """Press an object near the border of a grid, and shear it."""
    grid = SurfaceGrid(100, 90, 0.2)
    model = ContactModel(ElasticLayer(grid, GEL.elastomer, np.float64), GEL, CAREFUL)
    indenter, place = make_indenter(kind, **options), Pose(4.0, -3.0)
    state = model.place_object(model.undeformed_state(), indenter, place)
    share = {name: value / 2 for name, value in load.items()}
    for move in (
        Move(place, **share),
        Move(place, **load),
        Move(Pose(4.05, -3.0), **load),
        Move(Pose(4.35, -3.1), **load),
    ):
        state = model.step(state, indenter, move)
    return state


@pytest.mark.parametrize("load", [{"depth_mm": 0.2}, {"force_n": 0.3}], ids=["depth", "force"])
@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("sphere", {"diameter_mm": 3.0}),
        ("flat", {"diameter_mm": 1.5}),
        ("letters", {"text": "ii", "size_mm": 3.0}),
    ],
)
def test_a_window_does_not_change_the_solution(
    kind: str, options: dict[str, Any], load: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = moved(kind, options, load)
    with monkeypatch.context() as patch:
        everything = Window(slice(0, 90), slice(0, 100))
        patch.setattr(Window, "around", classmethod(lambda cls, nodes: everything))
        expected = moved(kind, options, load)
    assert found.depth_mm == pytest.approx(expected.depth_mm, rel=1e-4)
    np.testing.assert_allclose(found.displacement_mm, expected.displacement_mm, atol=2e-4)
    total = expected.pressure_mpa.sum()
    assert found.pressure_mpa.sum() == pytest.approx(total, rel=1e-3)
    assert np.abs(found.pressure_mpa - expected.pressure_mpa).sum() < 1e-2 * total


@given(
    first=st.tuples(st.integers(0, 59), st.integers(0, 79)),
    second=st.tuples(st.integers(0, 59), st.integers(0, 79)),
)
def test_a_window_contains_the_nodes_that_it_is_around(
    first: tuple[int, int], second: tuple[int, int]
) -> None:
    nodes = np.zeros((60, 80), np.bool_)
    nodes[first] = nodes[second] = True
    window = Window.around(nodes)
    assert window.contains(nodes)
    assert not window.reaches_its_border(nodes)
    assert np.count_nonzero(window.view_of(nodes)) == np.count_nonzero(nodes)
    part = window.view_of(nodes).astype(float)
    np.testing.assert_array_equal(window.embed_part(part, nodes.shape), nodes)
