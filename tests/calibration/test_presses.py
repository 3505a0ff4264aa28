"""Training pixels of a press and their ground truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactile_core.algorithms.circles.circle import Circle
from tactile_core.calibration.presses import FoundPress
from tactile_core.quantities import Frame

SHAPE, BALL_PX, CONTACT_PX, CENTRE_PX = (240, 320), 30.0, 22.0, (70.0, 80.0)


def press(marker_mask: np.ndarray | None) -> FoundPress:
    rng = np.random.default_rng(0)
    pixels = rng.integers(90, 160, (*SHAPE, 3)).astype(np.uint8)
    frame = Frame(pixels, ("red", "green", "blue"), 0.05, marker_mask=marker_mask)
    return FoundPress("ball", frame, Circle(CENTRE_PX, CONTACT_PX), BALL_PX)


@pytest.fixture
def marker_mask() -> np.ndarray:
    printed = np.zeros(SHAPE, np.bool_)
    for row in range(5, 240, 20):
        for column in range(5, 320, 20):
            printed[row : row + 9, column : column + 9] = True
    return printed


def test_no_training_pixel_shows_a_marker(marker_mask: np.ndarray) -> None:
    samples = press(marker_mask).training()
    undeformed = ~samples.gradients.any(axis=1)
    assert undeformed.sum() > 50
    assert (~undeformed).sum() > 50
    assert not marker_mask[samples.rows, samples.columns].any()


def test_training_pixels_are_on_the_ball_or_far_from_it() -> None:
    samples = press(None).training()
    undeformed = ~samples.gradients.any(axis=1)
    offset = np.stack([samples.columns, samples.rows], 1) - np.array(CENTRE_PX)
    distance = np.hypot(*offset.T)
    assert distance[~undeformed].max() < CONTACT_PX
    assert distance[undeformed & (distance > 0)].min() > 3 * BALL_PX
    # the surface of a ball falls away from its centre
    on = ~undeformed
    down = np.sqrt(BALL_PX**2 - distance[on] ** 2)
    np.testing.assert_allclose(samples.gradients[on], -offset[on] / down[:, None], atol=1e-5)


def test_pixels_for_heights_reach_the_rim_and_those_for_slopes_do_not() -> None:
    # the contact of a shallow press ends before the ball is too steep
    shallow = replace(press(None), circle=Circle(CENTRE_PX, 18.0))
    steepest = {}
    for for_heights in (False, True):
        samples = replace(shallow, for_heights=for_heights).training()
        steepest[for_heights] = float(np.hypot(*samples.gradients.T).max())
    rim = 18.0 / np.sqrt(BALL_PX**2 - 18.0**2)
    assert steepest[True] == pytest.approx(rim, rel=0.06)
    assert steepest[False] < 0.8 * rim


def test_heights_are_those_of_the_ball_and_of_undeformed_gel() -> None:
    found = press(None)
    samples = found.training()
    assert samples.heights_mm is not None
    on = samples.gradients.any(axis=1)
    distance = np.hypot(samples.columns - CENTRE_PX[0], samples.rows - CENTRE_PX[1])
    cap_mm = (np.sqrt(BALL_PX**2 - distance[on] ** 2) - np.sqrt(BALL_PX**2 - CONTACT_PX**2)) * 0.05
    rim_mm = samples.heights_mm[on] - cap_mm
    assert np.ptp(rim_mm) < 1e-5
    assert 0 < rim_mm.mean() < cap_mm.max()
    assert not samples.heights_mm[~on & (distance > CONTACT_PX)].any()


def test_the_rim_is_higher_on_a_thicker_gel() -> None:
    thin, thick = (
        replace(press(None), thickness_mm=thickness_mm).training() for thickness_mm in (1.0, 10.0)
    )
    assert thin.heights_mm is not None
    assert thick.heights_mm is not None
    assert thick.heights_mm.max() > thin.heights_mm.max() + 0.1
