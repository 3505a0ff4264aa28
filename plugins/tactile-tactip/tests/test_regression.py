"""What the displacement of pins says about a number, and how well it says it."""

import numpy as np
import pytest

from tactile_core.errors import CalibrationError
from tactile_tactip import regression
from tactile_tactip.regression import FEWEST, PinRegression, fit_regression

PINS = 2 * 20
_MIX = np.random.default_rng(0).normal(0, 1, (2, PINS))


def presses(count: int, seed: int, noise_px: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    """Displacements that two numbers cause, one of them not in proportion; and the numbers."""
    rng = np.random.default_rng(seed)
    numbers = rng.uniform(-1, 1, (count, 2))
    causes = np.column_stack([np.exp(numbers[:, 0]), numbers[:, 1]])
    return 3 * causes @ _MIX + rng.normal(0, noise_px, (count, PINS)), numbers


def test_a_curved_relation_is_found_in_new_presses() -> None:
    fitted = fit_regression(*presses(200, 1))
    moved_px, numbers = presses(100, 2)
    found, std = fitted.predict(moved_px)
    assert np.sqrt(((found - numbers) ** 2).mean(axis=0)).max() < 0.05  # a twelfth of their spread
    assert std.max() < 0.1


def test_the_deviation_is_that_of_the_errors_where_they_are_small_and_where_large() -> None:
    rng = np.random.default_rng(3)

    def noisy(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
        moved_px, numbers = presses(count, seed)
        uncertain = np.where(numbers[:, :1] < 0, 0.3, 0.03)
        return moved_px, numbers + uncertain * rng.normal(0, 1, numbers.shape)

    fitted = fit_regression(*noisy(400, 4))
    moved_px, numbers = noisy(2000, 5)
    found, std = fitted.predict(moved_px)
    uncertain = found[:, 0] < 0
    for part in (uncertain, ~uncertain):
        errors = np.abs(found - numbers)[part] / std[part]
        assert (errors < 1).mean() == pytest.approx(0.68, abs=0.1)
        assert (errors < 2).mean() == pytest.approx(0.95, abs=0.05)
    assert std[uncertain].mean() > 3 * std[~uncertain].mean()


def test_far_from_all_presses_the_deviation_grows() -> None:
    moved_px, numbers = presses(200, 1)
    fitted = fit_regression(moved_px, numbers)
    _, near = fitted.predict(moved_px[:1])
    _, far = fitted.predict(10 * moved_px[:1])
    assert (far > 10 * near).all()


def test_the_same_presses_give_the_same_numbers_also_when_read_back() -> None:
    moved_px, numbers = presses(100, 1)
    one, other = (fit_regression(moved_px, numbers) for _ in range(2))
    again = PinRegression.from_arrays(one.arrays())
    for copy in (other, again):
        for here, there in zip(one.predict(moved_px), copy.predict(moved_px), strict=True):
            assert (here == there).all()


def test_many_presses_are_thinned_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(regression, "_MOST", 150)  # of as many as usual the fit takes seconds
    moved_px, numbers = presses(400, 1)
    fitted = fit_regression(moved_px, numbers)
    assert len(fitted.places) == 150
    assert np.abs(fitted.predict(moved_px)[0] - numbers).max() < 0.1


def test_too_few_presses_are_refused() -> None:
    with pytest.raises(CalibrationError, match="label at least 50"):
        fit_regression(*presses(FEWEST - 1, 1))


def test_presses_that_do_not_differ_are_refused() -> None:
    moved_px, numbers = presses(60, 1)
    with pytest.raises(CalibrationError, match="the pins do not move"):
        fit_regression(np.zeros_like(moved_px), numbers)
    with pytest.raises(CalibrationError, match="a label is the same in all of them"):
        fit_regression(moved_px, numbers * [1, 0] + [0, 0.1])


@pytest.mark.parametrize("name", ["mean", "excess", "noise"])
def test_damaged_arrays_are_refused(name: str) -> None:
    arrays = fit_regression(*presses(60, 1)).arrays()
    with pytest.raises(ValueError, match="shape"):
        PinRegression.from_arrays({**arrays, name: arrays[name][:-1]})
    with pytest.raises(ValueError, match="finite"):
        PinRegression.from_arrays({**arrays, name: arrays[name] * np.nan})
    with pytest.raises(ValueError, match="positive"):
        PinRegression.from_arrays({**arrays, "length": -arrays["length"]})
