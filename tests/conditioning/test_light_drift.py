"""Illumination drift changes no measurement, however long a contact is held."""

from dataclasses import replace

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core import ContactMask, Frame, HeightMap, Pipeline
from tactile_core.algorithms.heights.sphere import BallPress

PRESS = BallPress((70.0, 62.0), BALL_MM, 0.8)


def drifted(lab: VirtualLab, press: BallPress | None, minute: int) -> Frame:
    """Make the frame of some minutes later; each channel drifts differently."""
    gains = 1 + 0.006 * minute * np.array([1.0, -1.0, 0.5])
    pixels = np.clip(np.rint(lab.image(press) * gains), 0, 255).astype(np.uint8)
    frame = Frame(pixels, ("red", "green", "blue"), lab.profile.image.mm_per_px, source="press")
    return replace(frame, sequence=minute)


def test_a_held_ball_is_not_absorbed_while_the_light_drifts(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    before = pipeline.process(drifted(lab, PRESS, 0))
    for minute in range(1, 11):
        now = pipeline.process(drifted(lab, PRESS, minute))
        assert now[HeightMap].mm.max() == pytest.approx(before[HeightMap].mm.max(), rel=0.03)
        assert now[ContactMask].area_mm2 == pytest.approx(before[ContactMask].area_mm2, rel=0.05)


def test_a_ball_held_for_long_leaves_no_imprint(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    for minute in range(10):
        pipeline.process(drifted(lab, PRESS, minute))
    reading = pipeline.process(drifted(lab, None, 10))
    assert reading[ContactMask].area_mm2 == 0
    assert np.abs(reading[HeightMap].mm).max() < 0.02
