"""Loads come back from the displacement that they cause."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.arrays.types import from_middle
from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.surface_loads import (
    Deformation,
    Shares,
    SurfaceLoads,
    pressure_mpa,
    surface_loads,
)
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid

CELL_MM, SHAPE = 0.22, (60, 80)
GEL = Elastomer(2.0, 0.145, 0.48)
X, Y = np.meshgrid(from_middle(SHAPE[1]) * CELL_MM, from_middle(SHAPE[0]) * CELL_MM)
CONTACT = np.hypot(X - 1, Y + 0.5) < 2.5
EVERYWHERE = np.ones(SHAPE, np.bool_)
NOTHING = np.zeros(SHAPE)


@pytest.fixture(scope="module")
def layer() -> ElasticLayer:
    return ElasticLayer(SurfaceGrid(135, 100, CELL_MM), GEL, np.float64)


@pytest.fixture(scope="module")
def pressure() -> np.ndarray:
    """The pressure under a ball."""
    square = 1 - ((X - 1) ** 2 + (Y + 0.5) ** 2) / 2.5**2
    return 0.1 * np.sqrt(np.maximum(square, 0))


def loads(
    layer: ElasticLayer,
    traction: np.ndarray,
    pressure: np.ndarray = NOTHING,
    valid: np.ndarray = EVERYWHERE,
    contact: np.ndarray = CONTACT,
) -> SurfaceLoads:
    """The loads that are found in the displacement that these cause."""
    shift = layer.displacement(traction, pressure)[:2]
    measured = Deformation(layer.indentation(pressure), shift, valid, contact)
    return surface_loads(layer, measured, Shares.from_contact(contact, CELL_MM), CELL_MM)


def total(traction: np.ndarray, pressure: np.ndarray = NOTHING) -> list[float]:
    """Fx, fy, fz and tz by their definition."""
    tz = (X * traction[1] - Y * traction[0]).sum()
    fx, fy = traction.sum((1, 2))
    return [one * CELL_MM**2 for one in (fx, fy, pressure.sum(), tz)]


def test_a_pressure_comes_back_from_its_indentation(
    layer: ElasticLayer, pressure: np.ndarray
) -> None:
    found = pressure_mpa(layer, layer.indentation(pressure), CONTACT)
    assert found.sum() == pytest.approx(pressure.sum(), rel=0.02)
    assert not found[~CONTACT].any()


@pytest.mark.parametrize("radius_mm", [0.7, 0.9, 1.3])
@pytest.mark.parametrize("middle_mm", [(0.0, 0.0), (0.11, 0.05)])
def test_a_border_that_runs_through_cells_takes_no_force(
    radius_mm: float, middle_mm: tuple[float, float]
) -> None:
    finer, cell_mm = 4, 0.44
    fine_mm, (rows, columns) = cell_mm / finer, (30, 40)
    fine = ElasticLayer(
        SurfaceGrid(columns * finer * 2, rows * finer * 2, fine_mm), GEL, np.float64
    )
    x = from_middle(columns * finer) * fine_mm - middle_mm[0]
    y = from_middle(rows * finer) * fine_mm - middle_mm[1]
    square = 1 - (x**2 + y[:, None] ** 2) / radius_mm**2
    acting = 0.1 * np.sqrt(np.maximum(square, 0))

    def averaged(plane: np.ndarray) -> np.ndarray:
        return plane.reshape(rows, finer, columns, finer).mean((1, 3))

    coarse = ElasticLayer(SurfaceGrid(2 * columns, 2 * rows, cell_mm), GEL, np.float64)
    height, share = averaged(fine.indentation(acting)), averaged(1.0 * (square > 0))
    found = pressure_mpa(coarse, height, share).sum() * cell_mm**2
    assert found == pytest.approx(acting.sum() * fine_mm**2, rel=0.025)


def test_a_pressure_is_found_from_any_start(layer: ElasticLayer, pressure: np.ndarray) -> None:
    height = layer.indentation(pressure)
    found = pressure_mpa(layer, height, CONTACT)
    again = pressure_mpa(layer, height, CONTACT, 2 * found)
    assert again.sum() == pytest.approx(found.sum(), rel=0.01)
    np.testing.assert_array_equal(pressure_mpa(layer, height, CONTACT, found), found)


def test_a_contact_that_sticks_holds_the_gel_back(layer: ElasticLayer) -> None:
    """Inward traction lifts the surface, so that less indentation is left for the pressure."""
    pressure = 0.1 * CONTACT
    inward = -0.04 * np.stack([X - 1, Y + 0.5]) / 2.5 * CONTACT
    moved = layer.displacement(inward, pressure)
    measured = Deformation(moved[2], moved[:2], EVERYWHERE, CONTACT)
    shares = Shares.from_contact(CONTACT, CELL_MM)
    true_n = pressure.sum() * CELL_MM**2
    found, errors = None, []
    for _ in range(4):
        found = surface_loads(layer, measured, shares, CELL_MM, start=found)
        errors.append(abs(found.resultant[2] / true_n - 1))
    assert errors[0] > 0.08
    assert errors[1] < 0.5 * errors[0]
    assert errors[-1] < 0.03


def test_a_place_of_the_image_shows_the_material_that_moved_there() -> None:
    stretch = 0.03 * np.stack([X, Y])  # of the image's places, by 3 % of the distance
    radius = np.hypot(X, Y)
    seen = Deformation(radius, stretch, EVERYWHERE, 1.0 * (radius < 3.0))
    found = seen.of_material(CELL_MM)
    inside = radius < 4.0
    # material at X moved to x with x − 0.03 x = X
    np.testing.assert_allclose(
        found.indentation_mm[inside], radius[inside] / 0.97, atol=0.01, rtol=0.005
    )
    np.testing.assert_allclose(found.shift_mm[:, inside], stretch[:, inside] / 0.97, atol=0.003)
    area = found.contact.sum() / seen.contact.sum()
    assert area == pytest.approx(0.97**2, abs=0.01)


def test_a_traction_comes_back_beside_the_spread_of_the_pressure(
    layer: ElasticLayer, pressure: np.ndarray
) -> None:
    turned = np.stack([0.02 - 0.01 * (Y + 0.5), 0.01 * (X - 1) - 0.015]) * CONTACT
    found = loads(layer, turned, pressure)
    np.testing.assert_allclose(found.resultant, total(turned, pressure), rtol=0.02)
    traction = found.traction_mpa(Shares.from_contact(CONTACT, CELL_MM))
    np.testing.assert_allclose(traction[:, CONTACT], turned[:, CONTACT], atol=2e-3)
    assert np.abs(found.unexplained_mm).max() < 0.02 * np.abs(layer.shift(turned)).max()


def test_what_is_not_measured_is_not_needed(layer: ElasticLayer) -> None:
    sheared = np.stack([0.02 * CONTACT, NOTHING])
    found = loads(layer, sheared, valid=X > -1.0)
    assert found.resultant[0] == pytest.approx(total(sheared)[0], rel=0.01)
    assert not found.unexplained_mm[:, X <= -1].any()
    assert not loads(layer, sheared, valid=~EVERYWHERE).resultant[[0, 1, 3]].any()


@pytest.mark.parametrize("columns", [slice(40, 41), slice(20, 60)])
def test_a_contact_of_one_cell_or_one_row_has_a_force(layer: ElasticLayer, columns: slice) -> None:
    contact = np.zeros(SHAPE, np.bool_)
    contact[30, columns] = True
    sheared = np.stack([0.02 * contact, NOTHING])
    found = loads(layer, sheared, contact=contact)
    assert found.resultant[0] == pytest.approx(total(sheared)[0], rel=0.01)


@pytest.mark.parametrize("factor", [0.85, 1.0, 1.1])
def test_the_spread_shows_by_which_factor_the_height_is_wrong(
    layer: ElasticLayer, pressure: np.ndarray, factor: float
) -> None:
    sheared = np.stack([0.02 * CONTACT, NOTHING])
    shift = layer.displacement(sheared, pressure)[:2]
    measured = Deformation(factor * layer.indentation(pressure), shift, EVERYWHERE, CONTACT)
    shares = Shares.from_contact(CONTACT, CELL_MM)
    true = total(sheared, pressure)
    fitted = surface_loads(layer, measured, shares, CELL_MM, held_mm2=0.0)
    np.testing.assert_allclose(fitted.resultant[[0, 2]], [true[0], true[2]], rtol=0.03)
    assert fitted.pressure_mpa.sum() * CELL_MM**2 == pytest.approx(fitted.resultant[2])
    held = surface_loads(layer, measured, shares, CELL_MM, held_mm2=1e6)
    assert held.resultant[2] == pytest.approx(factor * true[2], rel=0.03)


def test_noise_of_the_displacement_gives_the_force_the_stated_standard_deviation(
    layer: ElasticLayer,
) -> None:
    rng = np.random.default_rng(1)
    shares = Shares.from_contact(CONTACT, CELL_MM)
    found = []
    for _ in range(60):
        noise = rng.normal(0, 1e-3, (2, *SHAPE))
        measured = Deformation(NOTHING, noise, EVERYWHERE, CONTACT)
        found.append(surface_loads(layer, measured, shares, CELL_MM))
    actual = np.std([one.resultant[[0, 1, 3]] for one in found], axis=0)
    stated = 1e-3 * np.sqrt(np.diag(found[0].covariance))[[0, 1, 3]]
    np.testing.assert_allclose(actual, stated, rtol=0.35)
