from __future__ import annotations

import numpy as np
import pytest
from tactile_example_estimator.volume import PressedVolume, Volume, VolumeOptions

from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import HeightMap

MM_PER_PX = 0.05
CONTEXT = SensorContext(ImageSection(width_px=240, height_px=200, mm_per_px=MM_PER_PX), Gel())


def volume_of(height_mm: np.ndarray, **options: float) -> Volume:
    step = PressedVolume(VolumeOptions(**options), CONTEXT)
    height = HeightMap(height_mm.astype(np.float32), np.ones(height_mm.shape, bool), MM_PER_PX)
    return step.estimate(height)


def test_a_ball_displaces_the_volume_of_its_cap() -> None:
    radius_mm, depth_mm = 8.0, 1.0
    rows, columns = np.mgrid[:200, :240] * MM_PER_PX
    below = radius_mm**2 - (rows - 5) ** 2 - (columns - 6) ** 2
    cap_mm = np.sqrt(np.maximum(below, 0)) - (radius_mm - depth_mm)
    expected_mm3 = np.pi * depth_mm**2 * (3 * radius_mm - depth_mm) / 3
    assert volume_of(np.maximum(cap_mm, 0)).mm3 == pytest.approx(expected_mm3, rel=1e-3)


def test_undeformed_gel_has_no_volume_and_a_bulge_does_not_count() -> None:
    assert volume_of(np.zeros((200, 240))).mm3 == 0
    assert volume_of(np.full((200, 240), -0.1)).mm3 == 0


def test_heights_below_the_smallest_do_not_count() -> None:
    assert volume_of(np.full((200, 240), 0.01), min_height_mm=0.02).mm3 == 0


def test_the_volume_is_saved_and_streamed() -> None:
    volume = volume_of(np.ones((200, 240)))
    assert volume.summary() == {"pressed_volume_mm3": pytest.approx(120.0)}
    assert float(volume.arrays()["pressed_volume_mm3"]) == pytest.approx(120.0)
