"""The field beside a contact shows how thick and how compressible the gel is."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.arrays.types import from_middle
from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.layer_fit import LAYER_FIT, FittedLayer, LayerFit
from tactile_core.algorithms.force.surface_loads import Deformation, Shares
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid

CELL_MM, SHAPE = 0.44, (30, 40)
GRID = SurfaceGrid(64, 48, CELL_MM)
X, Y = np.meshgrid(from_middle(SHAPE[1]) * CELL_MM, from_middle(SHAPE[0]) * CELL_MM)
CONTACT = np.hypot(X - 1, Y + 0.5) < 2.5
EVERYWHERE = np.ones(SHAPE, np.bool_)
GEL = Elastomer(2.0, 0.145, 0.48)
PRESSURE = 0.2 * np.sqrt(np.maximum(1 - ((X - 1) ** 2 + (Y + 0.5) ** 2) / 2.5**2, 0))
TRACTION = np.stack([0.03 * CONTACT, -0.02 * CONTACT])


def fitted(
    nominal: Elastomer, valid: np.ndarray = EVERYWHERE, tolerance: float = 0.1
) -> FittedLayer:
    x, y, indentation = ElasticLayer(GRID, GEL, np.float64).displacement(TRACTION, PRESSURE)
    # the height of what touches is free of the bulge that shear causes beside it
    measured = Deformation(np.where(CONTACT, indentation, 0), np.stack([x, y]), valid, CONTACT)
    return LayerFit(GRID, nominal, tolerance).fit(measured, Shares.from_contact(CONTACT, CELL_MM))


@pytest.mark.parametrize("thickness_mm", [1.8, 2.0, 2.2])
@pytest.mark.parametrize("poisson_ratio", [0.432, 0.48, 0.499])
def test_thickness_and_poisson_s_ratio_come_back_and_so_does_the_force(
    thickness_mm: float, poisson_ratio: float
) -> None:
    found = fitted(Elastomer(thickness_mm, 0.145, poisson_ratio))
    assert found.elastomer.thickness_mm == pytest.approx(2.0, rel=0.05)
    assert found.elastomer.poisson_ratio == pytest.approx(0.48, abs=0.012)
    force = float(PRESSURE.sum()) * CELL_MM**2
    assert found.loads.resultant[2] == pytest.approx(force, rel=0.08)


def test_the_field_corrects_the_height_of_a_light_touch_more_than_of_a_deep_one() -> None:
    layer, shares, shown = (
        ElasticLayer(GRID, GEL, np.float64),
        Shares.from_contact(CONTACT, CELL_MM),
        [],
    )
    for share in (0.25, 1.0):
        pressure = share * PRESSURE
        x, y, indentation = layer.displacement(share * TRACTION, pressure)
        low = np.where(CONTACT, 0.9 * indentation, 0)
        measured = Deformation(low, np.stack([x, y]), EVERYWHERE, CONTACT)
        found = LayerFit(GRID, GEL, 0.001).fit(measured, shares).loads.resultant[2]
        shown.append(found / (pressure.sum() * CELL_MM**2))
    light, deep = shown
    assert light == pytest.approx(1, abs=0.03)
    assert 0.9 < deep < light


def test_the_modulus_is_left_as_it_is() -> None:
    assert fitted(Elastomer(2.0, 0.3, 0.48)).elastomer.shear_modulus_mpa == 0.3


def test_without_a_field_beside_the_contact_the_nominal_gel_stands() -> None:
    found = fitted(Elastomer(1.8, 0.145, 0.46), valid=CONTACT)
    assert found.elastomer.thickness_mm == pytest.approx(1.8)
    assert found.elastomer.poisson_ratio == pytest.approx(0.46)
    seen = fitted(Elastomer(1.8, 0.145, 0.46))
    assert found.covariance[2, 2] > 10 * seen.covariance[2, 2]


def test_a_gel_that_is_known_exactly_is_not_corrected() -> None:
    found = fitted(Elastomer(1.8, 0.145, 0.46), tolerance=1e-6)
    assert found.elastomer.thickness_mm == pytest.approx(1.8, rel=1e-3)


def test_the_fit_stays_in_its_bounds() -> None:
    found = fitted(Elastomer(0.5, 0.145, 0.2)).elastomer
    assert found.thickness_mm <= 0.5 * LAYER_FIT.greatest * 1.001
    assert LAYER_FIT.ratios[0] <= found.poisson_ratio <= LAYER_FIT.ratios[1] + 1e-6
