"""Transforms between an object's frame and the sensor frame."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_sim.contact_state import Pose


def test_a_positive_angle_rotates_x_towards_y() -> None:
    pose = Pose(x_mm=2.0, y_mm=-1.0, angle_deg=90.0)
    own_x = pose.to_object_frame(np.array([2.0]), np.array([0.0]))
    assert [float(part[0]) for part in own_x] == pytest.approx([1.0, 0.0])
    own_y = pose.to_object_frame(np.array([1.0]), np.array([-1.0]))
    assert [float(part[0]) for part in own_y] == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, -75.0, 180.0])
def test_transforms_are_inverse_to_each_other(angle_deg: float) -> None:
    x, y = np.random.default_rng(0).uniform(-5, 5, (2, 20))
    pose = Pose(0.7, -0.3, angle_deg)
    np.testing.assert_allclose(pose.back(*pose.to_object_frame(x, y)), (x, y), atol=1e-12)
