from __future__ import annotations

import numpy as np
import pytest
from tactile_example_arm.workpiece import ArmPose, Workpiece

from tactile_core import ContactMask, HeightMap, SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection

SHAPE, MM_PER_PX = (20, 30), 0.1
CONTEXT = SensorContext(ImageSection(width_px=30, height_px=20, mm_per_px=MM_PER_PX), Gel())
DOWN = np.diag([1, -1, -1]).astype(np.float32)
"""Rotation of a sensor that looks down: its z is the world's −z."""


def contact_of(depth_mm: float) -> tuple[HeightMap, ContactMask]:
    mm = np.zeros(SHAPE, np.float32)
    mm[5:15, 10:20] = depth_mm
    return HeightMap(mm, np.ones(SHAPE, bool), MM_PER_PX), ContactMask(mm > 0, MM_PER_PX)


def test_a_deeper_indentation_is_higher_in_the_world() -> None:
    step = Workpiece(Workpiece.Options(), CONTEXT)
    pose = ArmPose(np.float32([100, 50, 20]), DOWN)
    profile, touch = step.estimate(*contact_of(0.5), pose)
    assert profile.z_mm[10, 15] - profile.z_mm[0, 0] == pytest.approx(0.5)
    assert touch.world_mm == pytest.approx([100, 50, 20.5], abs=1e-4)


def test_without_contact_there_is_no_position() -> None:
    step = Workpiece(Workpiece.Options(), CONTEXT)
    _, touch = step.estimate(*contact_of(0.0), ArmPose(np.zeros(3, np.float32), DOWN))
    assert touch.world_mm is None
    assert not touch.touches
