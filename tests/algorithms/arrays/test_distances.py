"""Few points need no k-d tree: all their distances say the same."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from tactile_core.algorithms.arrays import distances as of_points
from tactile_core.algorithms.arrays.pitch import spacings
from tactile_core.algorithms.marker_tracking.nearest import nearest
from tactile_core.algorithms.marker_tracking.stretch import _pairs


@given(st.integers(0, 20), st.integers(0, 20), st.integers(0, 2**32 - 1))
def test_distances_are_euclidean(n: int, m: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(n, 2)), rng.normal(size=(m, 2)).astype(np.float32)
    np.testing.assert_allclose(of_points.distances(a, b), cdist(a, b), rtol=1e-12)


@pytest.mark.parametrize("within", [np.inf, 1.0, 0.1])
@pytest.mark.parametrize("count", [1, 4, 30])
def test_a_tree_finds_the_same_neighbours(
    monkeypatch: pytest.MonkeyPatch, count: int, within: float
) -> None:
    rng = np.random.default_rng(1)
    places, among = rng.normal(size=(40, 2)), rng.normal(size=(25, 2))
    few = nearest(places, among, count, within), spacings(among), _pairs(among, 0.5)
    monkeypatch.setattr(of_points, "_FEW", -1)
    many = nearest(places, among, count, within), spacings(among), _pairs(among, 0.5)
    np.testing.assert_allclose(few[0][0], many[0][0], rtol=1e-12)
    np.testing.assert_array_equal(few[0][1], many[0][1])
    np.testing.assert_allclose(few[1], many[1], rtol=1e-12)
    assert {tuple(pair) for pair in few[2]} == {tuple(sorted(pair)) for pair in many[2]}


def test_a_single_point_has_no_neighbour() -> None:
    assert spacings(np.zeros((1, 2))).tolist() == [np.inf]
    assert spacings(np.zeros((0, 2))).tolist() == []


def test_following_a_few_markers_imports_no_tree() -> None:
    code = """
import sys
import numpy as np
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.slip.marker_lattice import lattice_nodes
places = np.stack(np.mgrid[:12, :16], axis=-1).reshape(-1, 2) * 40.0
Neighbourhood.of(places)
print(len(lattice_nodes(places)[0]), "scipy.spatial" in sys.modules)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["192", "False"]
