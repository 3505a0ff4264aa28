"""Loads come back from the displacement that they cause."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.elasticity import Elastomer
from tactile_core.algorithms.elasticity.elastic_layer import ElasticLayer
from tactile_core.algorithms.elasticity.grid import Grid
from tactile_core.algorithms.elasticity.surface_loads import pressure_mpa, resultant, traction_mpa

CELL_MM, SHAPE = 0.22, (60, 80)
GEL = Elastomer(2.0, 0.145, 0.48)
X, Y = np.meshgrid(from_middle(SHAPE[1]) * CELL_MM, from_middle(SHAPE[0]) * CELL_MM)
CONTACT = np.hypot(X - 1, Y + 0.5) < 2.5
EVERYWHERE = np.ones(SHAPE, np.bool_)


@pytest.fixture(scope="module")
def layer() -> ElasticLayer:
    return ElasticLayer(Grid(135, 100, CELL_MM), GEL, np.float64)


@pytest.fixture(scope="module")
def pressure() -> np.ndarray:
    """The pressure under a ball."""
    square = 1 - ((X - 1) ** 2 + (Y + 0.5) ** 2) / 2.5**2
    return 0.1 * np.sqrt(np.maximum(square, 0))


def test_a_pressure_comes_back_from_its_indentation(
    layer: ElasticLayer, pressure: np.ndarray
) -> None:
    found = pressure_mpa(layer, layer.indentation(pressure), CONTACT)
    assert found.sum() == pytest.approx(pressure.sum(), rel=0.02)
    assert not found[~CONTACT].any()


def test_a_traction_comes_back_from_its_shift_and_the_spread_of_the_pressure(
    layer: ElasticLayer, pressure: np.ndarray
) -> None:
    turned = np.stack([0.02 - 0.01 * (Y + 0.5), 0.01 * (X - 1) - 0.015]) * CONTACT
    shift = layer.shift(turned) + layer.spread(pressure)
    found = traction_mpa(layer, shift, EVERYWHERE, CONTACT, pressure)
    np.testing.assert_allclose(
        resultant(pressure, found, CELL_MM), resultant(pressure, turned, CELL_MM), rtol=1e-3
    )


def test_what_is_not_measured_is_not_needed(layer: ElasticLayer, pressure: np.ndarray) -> None:
    sheared = np.stack([0.02 * CONTACT, np.zeros(SHAPE)])
    valid = X > -1.0
    found = traction_mpa(layer, layer.shift(sheared), valid, CONTACT, np.zeros(SHAPE))
    assert found[0].sum() == pytest.approx(sheared[0].sum(), rel=0.01)
    nothing = traction_mpa(layer, layer.shift(sheared), ~EVERYWHERE, CONTACT, np.zeros(SHAPE))
    assert not nothing.any()


@pytest.mark.parametrize("columns", [slice(40, 41), slice(20, 60)])
def test_a_contact_of_one_cell_or_one_row_has_a_force(layer: ElasticLayer, columns: slice) -> None:
    contact = np.zeros(SHAPE, np.bool_)
    contact[30, columns] = True
    sheared = np.stack([0.02 * contact, np.zeros(SHAPE)])
    found = traction_mpa(layer, layer.shift(sheared), EVERYWHERE, contact, np.zeros(SHAPE))
    assert found[0].sum() == pytest.approx(sheared[0].sum(), rel=0.01)


def test_a_force_beside_the_middle_turns_about_it() -> None:
    traction = np.zeros((2, *SHAPE))
    traction[1, 30, 79] = 1.0  # down, at the right
    fx, fy, fz, tz = resultant(np.zeros(SHAPE), traction, CELL_MM)
    assert (fx, fz) == (0, 0)
    assert tz == pytest.approx(fy * 39.5 * CELL_MM)
