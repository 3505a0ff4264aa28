"""The least force: statistics of readings near zero."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.errors import InputError
from tactile_core.evaluation.floor import floor_of, floor_table
from tactile_core.evaluation.floor.virtual import estimates
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Frame, RelativeLoad, Wrench

FORCES_N = np.round(np.arange(1, 41) * 0.01, 2)


@given(st.floats(-2, 2), st.floats(0.2, 3), st.booleans())
def test_a_force_is_distinguished_once_it_leaves_the_noise(
    offset: float, slope: float, towards_minus: bool
) -> None:
    noise = np.linspace(-0.05, 0.05, 101)
    sign = -1 if towards_minus else 1
    found = floor_of(
        "fx", "ball", offset + noise, sign * FORCES_N, offset + slope * sign * FORCES_N
    )
    assert found.slope_per_n == pytest.approx(slope)
    assert found.rest_std == pytest.approx(noise.std())
    assert found.least_n is not None
    assert slope * found.least_n > found.rest_limit
    assert slope * (found.least_n - 0.011) <= found.rest_limit + 1e-9


def test_one_larger_force_that_is_missed_counts() -> None:
    readings = FORCES_N.copy()
    readings[19] = 0.0
    found = floor_of("fz", "ball", np.zeros(10), FORCES_N, readings)
    assert found.least_n == FORCES_N[20]


def test_a_sensor_that_never_reacts_has_no_least_force() -> None:
    found = floor_of("fz", "ball", np.zeros(10), FORCES_N, np.zeros(40))
    assert found.least_n is None
    _, ((*_, least, _, _, slope),) = floor_table([found])
    assert (least, slope) == ("none", "0 N")


def test_too_few_frames_at_rest_are_refused() -> None:
    with pytest.raises(InputError, match="record the sensor at rest as well"):
        floor_of("fz", "ball", np.zeros(4), FORCES_N, FORCES_N)


def test_every_estimate_of_a_force_is_evaluated() -> None:
    frame = Frame(np.zeros((2, 2, 1), np.uint8), ("white",), 0.1)
    both = Reading(frame, {RelativeLoad: RelativeLoad(0.5), Wrench: Wrench(1, 2, 3, 4)}, {})
    assert estimates(both) == {"load": 0.5, "fx": 1, "fy": 2, "fz": 3}
    with pytest.raises(InputError, match=r"add core\.load or core\.force_elastic"):
        estimates(Reading(frame, {}, {}))
