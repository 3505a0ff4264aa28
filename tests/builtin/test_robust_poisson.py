"""Robust integration in place of the plain step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from support.elastic_surface import ball, indent

from tactile_core.builtin.poisson import Poisson, RobustPoisson
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.plugins.registry import resolve
from tactile_core.quantities import Gradients

SHAPE, MM_PER_PX = (120, 160), 0.1
CONTEXT = SensorContext(
    ImageSection(width_px=SHAPE[1], height_px=SHAPE[0], mm_per_px=MM_PER_PX), Gel()
)
TRUTH = indent(ball(7.03, 5.58, 0.6, 2.0), shape=SHAPE, mm_per_px=MM_PER_PX)


def slopes(height_mm: NDArray[np.float64], drift: float = 0.0, spoilt: float = 0.0) -> Gradients:
    gy, gx = np.gradient(height_mm, MM_PER_PX)
    rng = np.random.default_rng(0)
    gx, gy = (g + rng.normal(0, 0.01, SHAPE) for g in (gx + drift, gy))
    for g in (gx, gy):
        hit = rng.random(SHAPE) < spoilt
        g[hit] = rng.choice([-3, 3], hit.sum())
    valid = np.ones(SHAPE, bool)
    valid[3, 4] = False
    return Gradients(gx.astype(np.float32), gy.astype(np.float32), valid, MM_PER_PX, 12.5)


def error(step: Poisson | RobustPoisson, gradients: Gradients) -> float:
    return float(np.sqrt(np.mean((step.estimate(gradients).mm - TRUTH) ** 2)))


def test_it_is_registered_under_its_name() -> None:
    assert resolve("estimator", "core.robust_poisson") is RobustPoisson


def test_the_rest_surface_is_that_of_the_plain_step() -> None:
    robust = RobustPoisson(RobustPoisson.Options(), CONTEXT)
    plain = Poisson(Poisson.Options(), CONTEXT)
    gradients = slopes(TRUTH, drift=0.02)
    assert error(robust, gradients) < 1.1 * error(plain, gradients)
    height = robust.estimate(gradients)
    assert height.mm.dtype == np.float32
    assert np.array_equal(height.valid, gradients.valid)
    assert (height.mm_per_px, height.timestamp_s) == (MM_PER_PX, 12.5)


def test_outliers_bend_the_height_less_than_in_the_plain_step() -> None:
    robust = RobustPoisson(RobustPoisson.Options(), CONTEXT)
    plain = Poisson(Poisson.Options(), CONTEXT)
    gradients = slopes(TRUTH, spoilt=0.05)
    assert error(robust, gradients) < 0.25 * error(plain, gradients)


def test_the_outlier_slope_is_an_option() -> None:
    indulgent = RobustPoisson(RobustPoisson.Options(outlier_slope=100.0), CONTEXT)
    gradients = slopes(TRUTH, spoilt=0.05)
    plain = Poisson(Poisson.Options(), CONTEXT).estimate(gradients).mm
    np.testing.assert_allclose(indulgent.estimate(gradients).mm, plain, atol=0.02 * TRUTH.max())
