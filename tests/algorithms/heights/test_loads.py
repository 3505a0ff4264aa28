"""Loads that explain a surface: gel under rigid objects, whose slopes are partly wrong."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support.elastic_surface import Object, ball, indent

from tactile_core.algorithms.heights.loads import explain_by_loads, gather, steps
from tactile_core.algorithms.poisson import integrate

SHAPE, CELL_MM, THICKNESS_MM = (30, 40), 0.3, 2.0
Map = NDArray[np.float64]


def places() -> tuple[Map, Map]:
    y, x = (np.mgrid[: SHAPE[0], : SHAPE[1]] + 0.5) * CELL_MM
    return x, y


def pressed(*objects: Object, thickness_mm: float = THICKNESS_MM) -> Map:
    """Means over cells of the surface under objects."""
    fine = indent(
        *objects,
        shape=(8 * SHAPE[0], 8 * SHAPE[1]),
        mm_per_px=CELL_MM / 8,
        thickness_mm=thickness_mm,
    )
    return np.asarray(fine.reshape(SHAPE[0], 8, SHAPE[1], 8).mean((1, 3)))


def slopes(cells_mm: Map) -> tuple[Map, Map]:
    down, across = np.gradient(cells_mm, CELL_MM)
    return across, down


def explained(cells_mm: Map, loaded: NDArray[np.bool_], thickness_mm: float = THICKNESS_MM) -> Map:
    cell = CELL_MM / thickness_mm
    return explain_by_loads(cells_mm, np.hypot(*slopes(cells_mm)), loaded, (cell, cell)).cells_mm


def near(x_mm: float, y_mm: float, radius_mm: float) -> NDArray[np.bool_]:
    x, y = places()
    return np.asarray(np.hypot(x - x_mm, y - y_mm) < radius_mm)


@pytest.mark.parametrize("thickness_mm", [1.0, 2.0, 4.0])
def test_loads_on_a_ball_explain_the_whole_surface(thickness_mm: float) -> None:
    truth = pressed(ball(6.0, 4.5, 0.4, 3.0), thickness_mm=thickness_mm)
    found = explained(truth, near(6.0, 4.5, 2.0), thickness_mm)
    assert found == pytest.approx(truth, abs=0.03 * 0.4)


def test_a_level_of_the_height_is_not_explained() -> None:
    truth = pressed(ball(6.0, 4.5, 0.4, 3.0))
    loaded = near(6.0, 4.5, 2.0)
    assert explained(truth + 0.3, loaded) == pytest.approx(explained(truth, loaded), abs=1e-12)


def test_without_loaded_cells_nothing_is_explained() -> None:
    truth = pressed(ball(6.0, 4.5, 0.4, 3.0))
    found = explain_by_loads(truth, np.hypot(*slopes(truth)), np.zeros(SHAPE, bool), (0.15, 0.15))
    assert not found.cells_mm.any()
    assert all((weight == 1).all() for weight in found.weights)


def test_slopes_of_a_shadow_around_a_ball_hardly_count() -> None:
    truth = pressed(ball(6.0, 4.5, 0.4, 3.0))
    across, down = slopes(truth)
    shadow = near(6.0, 4.5, 1.6) & ~near(6.0, 4.5, 1.2)
    steeper = np.where(shadow, 1.2, 1.0)
    seen_mm = integrate(
        *((steeper * slope).astype(np.float32) for slope in (across, down)), mm_per_px=CELL_MM
    ).astype(float)
    depth_mm = truth.max()
    seen = (seen_mm.max() - seen_mm[0, 0]) / depth_mm
    found = explained(seen_mm, near(6.0, 4.5, 2.6)).max() / depth_mm
    assert seen > 1.02
    assert found == pytest.approx(1, abs=0.005)


def test_slopes_in_a_lightly_pressed_contact_are_believed_beside_a_strongly_pressed_one() -> None:
    truth = pressed(ball(3.0, 4.5, 0.2, 3.0), ball(9.0, 4.5, 0.8, 1.5))
    loaded = near(3.0, 4.5, 1.6) | near(9.0, 4.5, 2.4)
    slope = np.hypot(*slopes(truth))
    right, down = explain_by_loads(truth, slope, loaded, (0.15, 0.15)).weights
    light = near(3.0, 4.5, 0.6) & (slope > 0.1)
    assert light.any()
    assert (right[light[:, :-1]] == 1).all()
    assert (down[light[:-1]] == 1).all()


def test_gathered_steps_are_the_differences_from_the_neighbours() -> None:
    surface = np.zeros((3, 4))
    surface[1, 2] = 1.0
    assert gather(steps(surface)).tolist() == [[0, 0, -1, 0], [0, -1, 4, -1], [0, 0, -1, 0]]
