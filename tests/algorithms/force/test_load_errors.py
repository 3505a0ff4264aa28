"""Standard deviations of force and torque, from what a layer does not explain."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.arrays.types import from_middle
from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.layer_fit import LOAD_ERRORS, FittedLayer, load_variance
from tactile_core.algorithms.force.surface_loads import Deformation, Shares, surface_loads
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid

CELL_MM, SHAPE = 0.44, (30, 40)
GEL = Elastomer(2.0, 0.145, 0.48)
X, Y = np.meshgrid(from_middle(SHAPE[1]) * CELL_MM, from_middle(SHAPE[0]) * CELL_MM)
EVERYWHERE = np.ones(SHAPE, np.bool_)


def fitted(
    pressure_mpa: float = 0.0,
    middle_mm: tuple[float, float] = (0.0, 0.0),
    noise_mm: float = 0.001,
    turn: float = 0.0,
) -> tuple[FittedLayer, Deformation]:
    """A disc that is pressed and turned, and its loads."""
    layer = ElasticLayer(SurfaceGrid(80, 60, CELL_MM), GEL, np.float64)
    x, y = X - middle_mm[0], Y - middle_mm[1]
    contact = np.hypot(x, y) < 2.0
    traction = turn * np.stack([-y, x]) * contact
    moved = layer.displacement(traction, pressure_mpa * contact)
    moved[:2] += np.random.default_rng(0).normal(0, noise_mm, (2, *SHAPE))
    measured = Deformation(moved[2], moved[:2], EVERYWHERE, contact)
    loads = surface_loads(layer, measured, Shares.from_contact(contact, CELL_MM), CELL_MM)
    return FittedLayer(GEL, loads, np.zeros((4, 4))), measured


def deviations(fit: FittedLayer, measured: Deformation, tolerance: float = 0.0) -> np.ndarray:
    return np.sqrt(load_variance(fit, measured, CELL_MM, tolerance))


def test_an_object_that_is_not_twisted_has_a_torque_by_its_lever_alone() -> None:
    central = deviations(*fitted())
    beside = deviations(*fitted(middle_mm=(3.0, 0.0)))
    np.testing.assert_allclose(beside[:3], central[:3], rtol=0.3)
    assert beside[3] == pytest.approx(np.hypot(central[3], 3.0 * beside[1]), rel=0.15)


def test_shear_is_less_certain_under_a_larger_normal_force() -> None:
    light, heavy = fitted(0.01, noise_mm=0.0), fitted(1.0, noise_mm=0.0)
    normal = [fit.loads.resultant[2] for fit, _ in (light, heavy)]
    one, other = deviations(*light), deviations(*heavy)
    assert other[0] > 10 * one[0]
    assert other[0] >= LOAD_ERRORS.tilt * normal[1]
    assert one[0] < 0.01 * normal[0]


def test_a_torque_is_known_to_a_share_of_its_size() -> None:
    fit, measured = fitted(turn=0.02, noise_mm=0.0)
    torque = fit.loads.resultant[3]
    assert deviations(fit, measured)[3] == pytest.approx(LOAD_ERRORS.torque * torque, rel=0.05)


def test_what_the_layer_does_not_explain_makes_the_force_uncertain() -> None:
    calm, noisy = (deviations(*fitted(noise_mm=noise)) for noise in (0.001, 0.01))
    assert (noisy > 5 * calm)[[0, 1, 3]].all()


def test_an_uncertain_modulus_makes_all_forces_uncertain() -> None:
    fit, measured = fitted(0.5, turn=0.02)
    known, unknown = (deviations(fit, measured, tolerance) for tolerance in (0.0, 0.1))
    np.testing.assert_allclose(
        unknown**2 - known**2, (0.1 * fit.loads.resultant) ** 2, rtol=1e-6, atol=1e-12
    )
