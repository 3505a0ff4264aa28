"""Standard deviations of a force cover what they promise."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.force.cell_axes import fitted_error


@pytest.mark.parametrize(("rest", "share"), [(0.05, 0.0), (0.02, 0.1), (0.1, 0.03)])
def test_the_standard_deviation_is_that_of_the_errors_at_every_load(
    rest: float, share: float
) -> None:
    rng = np.random.default_rng(0)
    load = rng.uniform(0, 5, 4000)
    errors = np.hypot(rest, share * load) * rng.normal(size=4000)
    found = fitted_error(errors, load)
    within = np.abs(errors) < found.std(load)
    for fifth in np.array_split(np.argsort(found.std(load)), 5):
        assert within[fifth].mean() == pytest.approx(0.68, abs=0.08)


def test_a_perfect_fit_has_no_error() -> None:
    found = fitted_error(np.zeros(10), np.linspace(0, 1, 10))
    assert not found.std(np.linspace(0, 1, 10)).any()


def test_errors_that_only_grow_with_the_load_leave_a_floor() -> None:
    load = np.linspace(0, 2, 200)
    errors = 0.1 * load * np.random.default_rng(1).normal(size=200)
    assert fitted_error(errors, load).rest > 0
