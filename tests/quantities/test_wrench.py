"""A wrench: signs, frames and files."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.quantities import Wrench
from tactile_core.quantities.wrench import UNKNOWN_LOAD

newtons = st.floats(-50, 50)
known = Wrench(1.0, -2.0, 3.0, 4.0, 0.1, 0.2, 0.3, 0.4, timestamp_s=0.5)


def test_a_pressing_load_points_towards_the_camera_in_the_sensor_frame() -> None:
    np.testing.assert_array_equal(known.in_sensor_frame(), [1, -2, -3, 0, 0, 4])


def test_a_force_that_passes_beside_a_point_turns_about_it() -> None:
    right = Wrench(1.0, 0.0, 0.0, 0.0)
    assert right.about((0.0, 2.0)).tz_nmm == pytest.approx(2)  # above the point: from x towards y
    down = Wrench(0.0, 1.0, 0.0, 0.0)
    assert down.about((2.0, 0.0)).tz_nmm == pytest.approx(-2)


def test_values_and_standard_deviations_come_back() -> None:
    assert known.std is not None
    assert Wrench.from_values(known.values, known.std, 0.5).arrays().keys() == known.arrays().keys()
    np.testing.assert_array_equal(Wrench.from_values(known.values, known.std).values, known.values)
    np.testing.assert_array_equal(Wrench.from_values(known.values, known.std).std, known.std)
    assert Wrench.from_values(known.values).std is None


@given(newtons, newtons, newtons, newtons, st.floats(-9, 9), st.floats(-9, 9))
def test_there_and_back_again_is_the_same_torque(
    fx: float, fy: float, fz: float, tz: float, x: float, y: float
) -> None:
    wrench = Wrench(fx, fy, fz, tz)
    back = wrench.about((x, y)).about((-x, -y))
    np.testing.assert_allclose(back.values, wrench.values, atol=1e-9)


def test_the_torque_about_another_point_is_less_certain() -> None:
    std = known.about((3.0, 0.0)).std
    assert std is not None
    np.testing.assert_allclose(std, [0.1, 0.2, 0.3, np.hypot(0.4, 0.6)])


def test_files_hold_four_numbers_and_their_standard_deviations() -> None:
    arrays = known.arrays()
    assert {name: (a.shape, a.dtype) for name, a in arrays.items() if "wrench" in name} == {
        "wrench": ((4,), np.float32),
        "wrench_std": ((4,), np.float32),
    }
    again = Wrench.from_arrays(arrays)
    np.testing.assert_allclose(again.values, known.values)
    np.testing.assert_allclose(again.std, known.std)
    assert again.timestamp_s == 0.5


def test_an_unknown_standard_deviation_is_left_out() -> None:
    unknown = Wrench(1.0, 2.0, 3.0, 4.0)
    assert unknown.std is None
    assert "wrench_std" not in unknown.arrays()
    assert unknown.summary() == {
        "wrench": {"fx_n": 1.0, "fy_n": 2.0, "fz_n": 3.0, "tz_nmm": 4.0, "std": None}
    }
    assert known.summary()["wrench"]["std"] == [0.1, 0.2, 0.3, 0.4]


def test_a_component_of_which_nothing_is_known_is_not_measured() -> None:
    alone = Wrench(0, 0, 2.0, 0, UNKNOWN_LOAD, UNKNOWN_LOAD, 0.1, UNKNOWN_LOAD)
    assert alone.measured.tolist() == [False, False, True, False]
    assert Wrench(0, 0, 2.0, 0).measured.all()
