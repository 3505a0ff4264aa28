"""Splines through nodes find what has moved."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_sim.resampling import ImageSampler

GRID = SurfaceGrid(96, 64, 0.2)


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
