"""Contact step: a mask where the object touches, empty where nothing does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.builtin.contact import Contact
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import ContactMask, HeightMap

SHAPE, MM_PER_PX = (120, 160), 0.1
CONTEXT = SensorContext(
    ImageSection(width_px=SHAPE[1], height_px=SHAPE[0], mm_per_px=MM_PER_PX), Gel()
)


def masked(depth_mm: float, **options: Any) -> ContactMask:
    press = BallPress((70.3, 55.8), 4.0, depth_mm)
    height = press.height_mm(SHAPE, MM_PER_PX) if depth_mm else np.zeros(SHAPE)
    height = height + np.random.default_rng(0).normal(0, 0.002, SHAPE)
    quantity = HeightMap(height.astype(np.float32), np.ones(SHAPE, bool), MM_PER_PX, 12.5)
    return Contact(Contact.Options(**options), CONTEXT).estimate(quantity)


def test_a_press_is_masked() -> None:
    contact = masked(0.5)
    radius = BallPress((0, 0), 4.0, 0.5).contact_radius_mm
    assert contact.area_mm2 == pytest.approx(np.pi * radius**2, rel=0.35)
    assert contact.mask[56, 70]
    assert contact.timestamp_s == 12.5


def test_an_undeformed_gel_has_no_contact() -> None:
    assert masked(0).area_mm2 == 0


def test_options_set_the_thresholds() -> None:
    assert masked(0.5, min_indentation_mm=2).area_mm2 == 0
    assert masked(0.5, min_area_mm2=100).area_mm2 == 0
    assert masked(0.5, border_fraction=0.8).area_mm2 < masked(0.5).area_mm2


def test_an_impossible_fraction_is_refused() -> None:
    with pytest.raises(ValidationError, match="border_fraction"):
        Contact.Options(border_fraction=1.5)
