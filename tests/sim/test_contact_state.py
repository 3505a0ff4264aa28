"""Where an object's own frame lies in the sensor's."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.sim.contact_state import Pose


def test_a_turn_goes_from_x_towards_y() -> None:
    pose = Pose(x_mm=2.0, y_mm=-1.0, angle_deg=90.0)
    own_x = pose.into(np.array([2.0]), np.array([0.0]))
    assert [float(part[0]) for part in own_x] == pytest.approx([1.0, 0.0])
    own_y = pose.into(np.array([1.0]), np.array([-1.0]))
    assert [float(part[0]) for part in own_y] == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, -75.0, 180.0])
def test_there_and_back_is_where_it_was(angle_deg: float) -> None:
    x, y = np.random.default_rng(0).uniform(-5, 5, (2, 20))
    pose = Pose(0.7, -0.3, angle_deg)
    np.testing.assert_allclose(pose.back(*pose.into(x, y)), (x, y), atol=1e-12)
