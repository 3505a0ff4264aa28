"""Splines through nodes do not depend on how they are evaluated, and find what has moved."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.elasticity.viscoelasticity import SurfaceGrid
from tactile_core.sim import resampling
from tactile_core.sim.resampling import ImageSampler

GRID = SurfaceGrid(96, 64, 0.2)


@pytest.mark.skipif(not resampling._READS_BETWEEN, reason="this OpenCV rounds positions")
def test_four_linear_interpolations_are_the_cubic_spline(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    coefficients = rng.standard_normal((3, 22, 32), np.float32)
    # some places are beyond the border
    row, column = (rng.uniform(-2, n, (40, 50)).astype(np.float32) for n in (20, 30))
    by_linear = resampling._cubic(coefficients, row, column)
    monkeypatch.setattr(resampling, "_READS_BETWEEN", False)
    np.testing.assert_allclose(by_linear, resampling._cubic(coefficients, row, column), atol=1e-5)


@given(strain=st.floats(-0.7, 1.5))
def test_material_is_found_however_far_the_surface_is_stretched(strain: float) -> None:
    sampler = ImageSampler(GRID, (60, 80), 0.1)
    reach_mm = 3.0
    x, y = GRID.nodes_mm
    along = strain * np.clip(x, -reach_mm, reach_mm)
    displacement_mm = np.stack([along, np.zeros_like(x), y])
    now = sampler.at_present(displacement_mm, sampler.origins(displacement_mm[:2]))
    here = sampler.window.view_of(x)
    # splines are not straight where the strain ends
    inside = abs(here) < 0.5 * reach_mm * (1 + strain)
    np.testing.assert_allclose(now[0][inside], (here * strain / (1 + strain))[inside], atol=1e-3)
