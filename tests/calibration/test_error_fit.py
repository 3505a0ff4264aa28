"""The size of errors, from held-out surfaces of known error."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.elastic_surface import ball, indent

from tactile_core.algorithms.poisson import integrate
from tactile_core.calibration.score import HeldOutSurface, fitted_errors
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Frame

SHAPE, SCALE_MM = (60, 80), 0.1
Y, X = np.indices(SHAPE).astype(np.float32)
APART_PX = np.hypot(X - 40, Y - 30)
# the gel is thin, so that it bulges near the ball alone
THICKNESS_MM = 0.5
PRESS = indent(ball(4.0, 3.0, 0.2, 3.0), shape=SHAPE, mm_per_px=SCALE_MM, thickness_mm=THICKNESS_MM)


def surface(
    gain: float, seed: int, noise: float = 0.0, thickness_mm: float = THICKNESS_MM
) -> HeldOutSurface:
    """A press of a ball whose slopes are measured too steep by a factor, with noise."""
    gy, gx = (np.asarray(g / SCALE_MM, np.float32) for g in np.gradient(PRESS))
    rng = np.random.default_rng(seed)
    rows, columns = np.nonzero((APART_PX < 8) | (APART_PX > 25))
    true = (np.stack([gx, gy], -1) * (APART_PX < 8)[..., None])[rows, columns]
    sx, sy = ((gain * g + rng.normal(0, noise, SHAPE)).astype(np.float32) for g in (gx, gy))
    frame = Frame(np.zeros((*SHAPE, 3), np.uint8), ("r", "g", "b"), SCALE_MM, 255.0)
    press = Press(frame, rows.astype(np.int32), columns.astype(np.int32), true)
    height_mm = integrate(sx, sy, mm_per_px=SCALE_MM)
    return HeldOutSurface(sx, sy, height_mm, press, thickness_mm)


def test_nothing_is_said_without_surfaces() -> None:
    assert fitted_errors([]) is None


@given(st.floats(0.01, 0.2))
def test_the_gain_is_the_spread_of_factors(spread: float) -> None:
    errors = fitted_errors([surface(1 - spread, 1), surface(1 + spread, 2)])
    assert errors is not None
    assert errors.gain_std == pytest.approx(spread, rel=1e-3)


def test_noise_is_found_in_the_table() -> None:
    errors = fitted_errors([surface(1.0, seed, noise=0.03) for seed in range(4)])
    assert errors is not None
    assert errors.std[-1] == pytest.approx(0.03, rel=0.1)


def test_independent_noise_is_correlated_over_a_pixel_or_two() -> None:
    errors = fitted_errors([surface(1.0, seed, noise=0.03) for seed in range(4)])
    assert errors is not None
    assert 0.3 * SCALE_MM < errors.correlation_mm < 4 * SCALE_MM


def test_a_thinner_gel_reveals_more_of_the_error_in_the_height() -> None:
    thin, thick = (surface(1.0, 1, noise=0.1, thickness_mm=mm) for mm in (0.5, 8.0))
    at = thin.truth.rows, thin.truth.columns
    assert (
        thin.levelled_mm[at][thin.undeformed].std() < thick.levelled_mm[at][thick.undeformed].std()
    )
