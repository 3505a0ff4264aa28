"""Coulomb's law at every node: slip from the edge inwards, in agreement with theory."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_sim.friction import Grip, solve_friction
from tactile_sim.normal_contact import solve_normal

FRICTION = 0.6


class BallOnHalfSpace:
    """A ball pressed with 0.06 N, before it moves along x."""

    def __init__(self, nu: float) -> None:
        self.layer = ElasticLayer(
            SurfaceGrid(240, 240, 0.02), Elastomer(np.inf, 0.145, nu), np.float64
        )
        x, y = self.layer.grid.nodes_mm
        self.pressure = solve_normal(
            self.layer.indentation,
            -(x**2 + y**2) / 6,
            np.zeros_like(x),
            total_mpa=0.06 / self.layer.grid.cell_mm2,
            tolerance=1e-5,
        ).pressure
        self.limit = FRICTION * self.pressure

    def moved(self, distance_mm: float, **options: float) -> Grip:
        wanted = np.zeros((2, *self.pressure.shape))
        wanted[0] = distance_mm
        start = Grip.none(self.pressure.shape, np.float64)
        return solve_friction(self.layer, wanted, self.limit, start, tolerance=1e-5, **options)


@pytest.fixture(scope="module", params=[0.0, 0.48])
def ball(request: pytest.FixtureRequest) -> BallOnHalfSpace:
    return BallOnHalfSpace(request.param)


def test_stick_radius_agrees_with_cattaneo_and_mindlin(ball: BallOnHalfSpace) -> None:
    # on a grid, the area is more accurate than a single radius
    area = np.count_nonzero(ball.pressure)
    seen = []
    for distance in np.linspace(0.01, 0.12, 12):
        grip = ball.moved(distance)
        share = grip.traction[0].sum() / ball.limit.sum()
        if share > 0.95:
            break
        stick = (ball.pressure > 0) & ~grip.slip_mm.any(axis=0)
        radius = np.sqrt(np.count_nonzero(stick) / area)
        seen.append(share)
        assert radius == pytest.approx((1 - share) ** (1 / 3), rel=0.01)
    assert max(seen) > 0.9


def test_traction_never_exceeds_friction_times_pressure(ball: BallOnHalfSpace) -> None:
    size = np.hypot(*ball.moved(0.05).traction)
    assert (size <= ball.limit * (1 + 1e-9)).all()


def test_traction_in_slip_is_at_its_limit_and_along_the_slip(
    ball: BallOnHalfSpace,
) -> None:
    grip = ball.moved(0.05)
    size, slip = np.hypot(*grip.traction), np.hypot(*grip.slip_mm)
    slips = (ball.pressure > 0) & (slip > 1e-4)
    assert slips.any()
    np.testing.assert_allclose(size[slips], ball.limit[slips], rtol=1e-9)
    along = (grip.traction * grip.slip_mm).sum(0)[slips]
    np.testing.assert_allclose(along, (size * slip)[slips], rtol=1e-6)


def test_force_in_gross_slip_is_coulombs(
    ball: BallOnHalfSpace,
) -> None:
    grip = ball.moved(0.5)
    assert grip.slip_mm.any(axis=0)[ball.pressure > 0].all()
    assert grip.traction[0].sum() == pytest.approx(ball.limit.sum(), rel=1e-3)


def test_rate_dependent_friction_reduces_fast_slip(ball: BallOnHalfSpace) -> None:
    slow, quick = ball.moved(0.5), ball.moved(0.5, free_slip_mm=1.0)
    assert quick.traction[0].sum() > 1.1 * slow.traction[0].sum()
    assert quick.slip_mm[0][ball.pressure > 0].max() < slow.slip_mm[0][ball.pressure > 0].max()


def test_zero_friction_shears_nothing() -> None:
    layer = ElasticLayer(SurfaceGrid(32, 32, 0.2), Elastomer(2.0, 0.145, 0.48))
    wanted = np.full((2, 32, 32), 0.3, np.float32)
    grip = solve_friction(
        layer, wanted, np.zeros((32, 32), np.float32), Grip.none((32, 32), np.float32)
    )
    assert not grip.traction.any()
