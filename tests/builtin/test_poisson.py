"""Height step: exact integration, relative to the undeformed surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError
from support.elastic_surface import ball, indent

from tactile_core.builtin.poisson import Poisson
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import Gradients, HeightMap, ReferenceGradients

SHAPE, MM_PER_PX = (120, 160), 0.1
CONTEXT = SensorContext(
    ImageSection(width_px=SHAPE[1], height_px=SHAPE[0], mm_per_px=MM_PER_PX), Gel()
)
PRESS = indent(ball(7.03, 5.58, 0.6, 2.0), shape=SHAPE, mm_per_px=MM_PER_PX)


def step(**options: Any) -> Poisson:
    return Poisson(Poisson.Options(**options), CONTEXT)


def slopes(height_mm: NDArray[np.float64], drift: tuple[float, float] = (0, 0)) -> Gradients:
    gy, gx = np.gradient(height_mm, MM_PER_PX)
    noise = np.random.default_rng(0).normal(0, 0.01, (2, *SHAPE))
    valid = np.ones(SHAPE, bool)
    valid[3, 4] = False
    return Gradients(
        (gx + drift[0] + noise[0]).astype(np.float32),
        (gy + drift[1] + noise[1]).astype(np.float32),
        valid,
        MM_PER_PX,
        timestamp_s=12.5,
    )


@pytest.mark.parametrize("boundary", ["neumann", "dirichlet"])
def test_the_height_of_a_press_is_measured_from_the_undeformed_gel(boundary: str) -> None:
    truth = PRESS
    height = step(boundary=boundary).estimate(slopes(truth)).mm
    assert height.dtype == np.float32
    assert np.sqrt(np.mean((height - truth) ** 2)) < 0.02 * truth.max()


def test_drift_of_the_light_does_not_tilt_the_map() -> None:
    truth = PRESS
    height = step().estimate(slopes(truth, drift=(0.02, -0.01))).mm
    assert np.sqrt(np.mean((height - truth) ** 2)) < 0.02 * truth.max()


def test_drift_can_be_left_in() -> None:
    truth = PRESS
    height = step(drift_slope=0, levelled=False).estimate(slopes(truth, drift=(0.02, 0))).mm
    assert height[:, -1].mean() - height[:, 0].mean() == pytest.approx(0.02 * 15.9, rel=0.1)


def test_an_undeformed_gel_is_flat_at_zero() -> None:
    height = step().estimate(slopes(np.zeros(SHAPE))).mm
    assert np.abs(height).max() < 0.01


def test_filled_pixels_stay_invalid() -> None:
    gradients = slopes(np.zeros(SHAPE))
    height = step().estimate(gradients)
    assert isinstance(height, HeightMap)
    assert np.array_equal(height.valid, gradients.valid)
    assert (height.mm_per_px, height.timestamp_s) == (MM_PER_PX, 12.5)


def test_an_unknown_boundary_is_refused() -> None:
    with pytest.raises(ValidationError, match="boundary"):
        Poisson.Options(boundary="periodic")


def test_slopes_of_the_reference_are_errors() -> None:
    wave = 0.05 * np.cos(np.linspace(0, 5, SHAPE[1])) * np.ones(SHAPE)
    undeformed = slopes(wave)
    own = ReferenceGradients(undeformed.x, undeformed.y)
    assert not step().estimate(undeformed, own).mm.any()
    pressed = slopes(PRESS + wave)
    plain, relative = step().estimate(pressed).mm, step().estimate(pressed, own).mm
    truth = PRESS
    assert np.abs(relative - truth).max() < 0.03 * truth.max()
    assert np.abs(relative - truth).mean() < 0.5 * np.abs(plain - truth).mean()


def test_smooth_errors_are_left_in_on_request() -> None:
    wave = 0.05 * np.cos(np.linspace(0, 5, SHAPE[1])) * np.ones(SHAPE)
    pressed = slopes(PRESS + wave)
    far = np.hypot(*(np.indices(SHAPE)[::-1] - np.array([[[70.3]], [[55.8]]]))) > 50
    left = [step(levelled=levelled).estimate(pressed).mm[far].std() for levelled in (True, False)]
    assert left[0] < 0.7 * left[1]
