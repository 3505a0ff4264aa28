"""Pressing a rigid object into a bonded layer agrees with theory."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_sim.normal_contact import NormalContact, solve_normal

THICKNESS_MM, MODULUS_MPA, NU = 2.0, 0.145, 0.48
RADIUS_MM = 3.0


def dimitriadis_n(radius_mm: float, depth_mm: float, nu: float = NU) -> float:
    """Force on a ball on a bonded layer: Dimitriadis et al., Biophys. J. 82 (2002), equation 12."""
    chi = np.sqrt(radius_mm * depth_mm) / THICKNESS_MM
    a = -(1.2876 - 1.4678 * nu + 1.3442 * nu**2) / (1 - nu)
    b = (0.6387 - 1.0277 * nu + 1.5164 * nu**2) / (1 - nu)
    young = 2 * MODULUS_MPA * (1 + nu)
    hertz = 4 * young / (3 * (1 - nu**2)) * np.sqrt(radius_mm) * depth_mm**1.5
    series = (
        1
        - 2 * a / np.pi * chi
        + 4 * a**2 / np.pi**2 * chi**2
        - 8 / np.pi**3 * (a**3 + 4 * np.pi**2 / 15 * b) * chi**3
        + 16 * a / np.pi**4 * (a**3 + 3 * np.pi**2 / 5 * b) * chi**4
    )
    return float(hertz * series)


def _layer(spacing_mm: float, thickness_mm: float = THICKNESS_MM, nu: float = NU) -> ElasticLayer:
    grid = SurfaceGrid.covering(12.0, 12.0, spacing_mm)
    return ElasticLayer(grid, Elastomer(thickness_mm, MODULUS_MPA, nu), np.float64)


def _ball(layer: ElasticLayer, **load: float) -> tuple[NormalContact, float]:
    """Press a ball to depth_mm or with force_n; return the contact and the force."""
    x, y = layer.grid.nodes_mm
    cell = layer.grid.cell_mm2
    overlap = load.get("depth_mm", 0.0) - (x**2 + y**2) / (2 * RADIUS_MM)
    total = load["force_n"] / cell if "force_n" in load else None
    found = solve_normal(
        layer.indentation, overlap, np.zeros_like(overlap), total_mpa=total, tolerance=1e-5
    )
    return found, float(found.pressure.sum() * cell)


@pytest.mark.parametrize(("chi", "allowed"), [(0.1, 0.02), (0.2, 0.02), (0.35, 0.04)])
@pytest.mark.parametrize("nu", [0.3, NU])
def test_indentation_of_a_bonded_layer_agrees_with_dimitriadis_2002(
    chi: float, allowed: float, nu: float
) -> None:
    depth = (chi * THICKNESS_MM) ** 2 / RADIUS_MM
    contact_radius = chi * THICKNESS_MM
    _, force = _ball(_layer(contact_radius / 10, nu=nu), depth_mm=depth)
    assert force == pytest.approx(dimitriadis_n(RADIUS_MM, depth, nu), rel=allowed)


def test_contact_radius_on_a_half_space_agrees_with_hertz() -> None:
    layer = _layer(0.025, np.inf)
    found, force = _ball(layer, force_n=0.06)
    radius = np.sqrt((found.pressure > 0).sum() * layer.grid.cell_mm2 / np.pi)
    hertz = (3 * force * RADIUS_MM * (1 - NU) / (8 * MODULUS_MPA)) ** (1 / 3)
    assert radius == pytest.approx(hertz, rel=0.01)
    peak = 1.5 * force / (np.pi * hertz**2)
    assert found.pressure.max() == pytest.approx(peak, rel=0.01)


def test_pressure_and_gap_are_complementary() -> None:
    layer = _layer(0.1)
    x, y = layer.grid.nodes_mm
    overlap = 0.2 - (x**2 + y**2) / (2 * RADIUS_MM) + 0.02 * np.cos(6 * x)
    p = solve_normal(layer.indentation, overlap, np.zeros_like(overlap), tolerance=1e-5).pressure
    gap = layer.indentation(p) - overlap
    assert p.min() >= 0
    assert np.abs(gap[p > 0]).max() < 1e-4 * overlap.max()
    assert gap.min() > -1e-4 * overlap.max()


def test_force_control_and_depth_control_agree() -> None:
    layer = _layer(0.1)
    by_depth, force = _ball(layer, depth_mm=0.15)
    by_force, same = _ball(layer, force_n=force)
    assert same == pytest.approx(force)
    assert by_force.approach_mm == pytest.approx(0.15, rel=1e-3)
    np.testing.assert_allclose(
        by_force.pressure, by_depth.pressure, atol=5e-3 * by_depth.pressure.max()
    )


def test_work_of_pressing_is_stored_in_the_layer() -> None:
    layer = _layer(0.1)
    depths = np.linspace(0, 0.3, 25)
    contacts = [_ball(layer, depth_mm=depth) for depth in depths]
    from scipy.integrate import simpson

    work = simpson([force for _, force in contacts], x=depths)
    p = contacts[-1][0].pressure
    stored = 0.5 * (p * layer.indentation(p)).sum() * layer.grid.cell_mm2
    assert stored == pytest.approx(work, rel=1e-3)


def test_an_object_above_the_gel_presses_nothing() -> None:
    layer = _layer(0.3)
    found, force = _ball(layer, depth_mm=-0.01)
    assert force == 0
    assert not found.pressure.any()
