"""Axes and position of a load cell, found from shear that sensor and cell both measure."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.force.cell_axes import (
    ToolOffset,
    about_centre,
    cell_rotation,
    tool_offset,
)
from tactile_core.quantities import Wrench


@given(st.floats(-179, 179), st.booleans(), st.integers(0, 100))
@settings(max_examples=25, deadline=None)
def test_the_rotation_of_the_axes_is_found(degrees: float, mirrored: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = rng.normal(size=(50, 2))
    normal = rng.uniform(0, 3, 50)
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    hand = np.diag([1.0, -1.0 if mirrored else 1.0])
    shift = 0.06 * image + 0.01 * normal[:, None]  # pressing moves the markers, too
    found = cell_rotation(shift, image @ (turn @ hand), normal)
    assert found is not None
    assert found.mirrored == mirrored
    assert found.matrix == pytest.approx(turn @ hand, abs=1e-6)
    assert (image @ (turn @ hand)) @ found.matrix.T == pytest.approx(image, abs=1e-6)


def test_shear_along_one_axis_does_not_determine_a_rotation() -> None:
    rng = np.random.default_rng(0)
    along = rng.normal(size=(80, 1)) * [1.0, 0.0]
    noise = 1e-3 * rng.normal(size=(2, 80, 2))
    assert cell_rotation(along + noise[0], along + noise[1], np.zeros(80)) is None


@given(st.floats(-8, 8), st.floats(-8, 8))
@settings(max_examples=25, deadline=None)
def test_the_position_of_the_torque_axis_is_found(x_mm: float, y_mm: float) -> None:
    rng = np.random.default_rng(1)
    moment, forces = rng.normal(size=60), rng.normal(size=(60, 4))
    forces[:, 3] = 4.0 * moment
    cell = forces.copy()
    for row, force in zip(cell, forces, strict=True):
        row[3] = Wrench(*force).about((x_mm, y_mm)).tz_nmm
    found = tool_offset(moment, cell)
    assert found is not None
    assert found.mm == pytest.approx((x_mm, y_mm), abs=1e-6)
    assert about_centre(cell, found) == pytest.approx(forces, abs=1e-6)


def test_without_shear_the_position_is_unknown() -> None:
    forces = np.zeros((20, 4))
    forces[:, 3] = np.arange(20)
    assert tool_offset(np.arange(20.0), forces) is None


def test_an_offset_within_its_error_is_not_determined() -> None:
    assert not ToolOffset((0.1, 0.2), (0.1, 0.1)).determined
    assert ToolOffset((0.1, 0.5), (0.1, 0.1)).determined
