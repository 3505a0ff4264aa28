import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.slopes.colour_table import Axis, ColourTable, bake


def linear_model(features: np.ndarray) -> np.ndarray:
    """Return normals whose components are a tenth of the first two changes."""
    return np.asarray(0.1 * features[:, :2], np.float32)


@given(st.floats(-0.9, 0.0), st.floats(0.1, 3.0), st.integers(8, 80))
def test_an_axis_covers_the_given_changes(low: float, high: float, n: int) -> None:
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


def test_the_finest_axis_still_holds_every_ratio_in_a_byte() -> None:
    axis = Axis.spanning(np.linspace(-0.02, 0.03, 3000, dtype=np.float32).reshape(-1, 3))
    assert round(1.03 * axis.per_unit) <= 255


@pytest.mark.parametrize("count", [11, 12, 80])
def test_baking_gives_the_model_at_every_entry(count: int) -> None:
    table = bake(linear_model, Axis(per_unit=10, first=5, count=count))
    values = table.axis.values()
    first, second, third = (values[i] for i in (3, count - 1, 0))
    expected = linear_model(np.array([[first, second, third]]))[0]
    np.testing.assert_allclose(table.nearest(np.array([[first, second, third]]))[0], expected)
    assert table.normal_xy.shape == (count, count, count)


def test_interpolation_between_entries_loses_little_curvature() -> None:
    def bent(features: np.ndarray) -> np.ndarray:
        return np.asarray(np.tanh(2 * features[:, :2]) * (1 + features[:, 2:3]), np.float32)

    table = bake(bent, Axis(per_unit=50, first=20, count=80))
    values = table.axis.values()
    exact = bent(np.stack(np.meshgrid(values, values, values, indexing="ij"), -1).reshape(-1, 3))
    normal_xy = np.stack([table.normal_xy.real, table.normal_xy.imag], -1).reshape(-1, 2)
    assert np.abs(normal_xy - exact).max() < 0.003
