import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tactile_core.algorithms.colour_table import (
    STEEPEST_SINE,
    Axis,
    ColourTable,
    bake,
    to_gradient,
    to_sines,
)

slopes = arrays(np.float32, (5, 2), elements=st.floats(-3, 3, width=32))


def linear_model(features: np.ndarray) -> np.ndarray:
    """Sines that are a tenth of the first two changes."""
    return np.asarray(0.1 * features[:, :2], np.float32)


@given(slopes)
def test_sines_and_slopes_are_inverse(gradient: np.ndarray) -> None:
    np.testing.assert_allclose(to_gradient(to_sines(gradient)), gradient, rtol=1e-4, atol=1e-5)


@given(arrays(np.float32, (5, 2), elements=st.floats(-50, 50, width=32)))
def test_no_sine_gives_a_slope_beyond_the_steepest(sines: np.ndarray) -> None:
    limit = STEEPEST_SINE / np.sqrt(1 - STEEPEST_SINE**2)
    assert np.linalg.norm(to_gradient(sines), axis=1).max() <= limit * 1.001


@given(st.floats(-0.9, 0.0), st.floats(0.1, 3.0), st.integers(8, 80))
def test_an_axis_covers_the_changes_that_it_was_made_for(low: float, high: float, n: int) -> None:
    axis = Axis.spanning(np.linspace(low, high, 3000, dtype=np.float32).reshape(-1, 3), n)
    values = axis.values()
    step = 1 / axis.per_unit
    assert values[0] <= low + step
    assert values[-1] >= high - step


def test_the_nearest_entry_is_within_half_a_step() -> None:
    axis = Axis(per_unit=50, first=20, count=80)
    table = ColourTable(axis, np.zeros((80,) * 3, np.complex64))
    change = np.random.default_rng(0).uniform(-0.6, 0.95, (200, 3)).astype(np.float32)
    found = axis.values()[table.bins(change)]
    assert np.abs(found - change).max() <= 0.5 / axis.per_unit + 1e-6


def test_baking_samples_the_model_at_its_entries() -> None:
    table = bake(linear_model, Axis(per_unit=10, first=5, count=12))
    values = table.axis.values()
    expected = to_gradient(linear_model(np.array([[values[3], values[7], values[0]]])))[0]
    assert table.slopes[3, 7, 0] == np.complex64(complex(*expected))


def test_three_bytes_index_the_flat_table() -> None:
    rng = np.random.default_rng(2)
    slopes = (rng.normal(size=(6, 6, 6)) + 1j * rng.normal(size=(6, 6, 6))).astype(np.complex64)
    flat = ColourTable(Axis(3, 0, 6), slopes).flat()
    for r, g, b in ((0, 0, 0), (5, 1, 3), (2, 4, 5)):
        assert flat[r | g << 8 | b << 16] == slopes[r, g, b]
