"""Health of lights and markers, from readings."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.health import GelHealth
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.quantities import Frame, MarkerField

PERIOD_S = 0.5


@pytest.fixture(scope="module")
def pipeline(lab: VirtualLab) -> Pipeline:
    return Pipeline(lab.profile, lab.bundle)


def judged(pipeline: Pipeline, images: Iterable[np.ndarray]) -> GelHealth:
    """The health after these images, twice a second."""
    health = GelHealth()
    for number, pixels in enumerate(images):
        frame = pipeline.frame(pixels, timestamp_s=number * PERIOD_S)
        health.add(pipeline.process(frame))
    return health


def undeformed(lab: VirtualLab, count: int = 6) -> list[np.ndarray]:
    return [lab.image(None, seed=seed) for seed in range(count)]


def test_a_healthy_gel_has_no_warning(lab: VirtualLab, pipeline: Pipeline) -> None:
    health = judged(pipeline, undeformed(lab))
    assert [found.verdict for found in health.lights().values()] == ["ok"] * 3
    assert health.judge_saturation().verdict == "ok"
    assert health.markers().verdict == "unknown"


@pytest.mark.parametrize(("gain", "verdict"), [(0.93, "ok"), (0.7, "warning"), (1.15, "warning")])
def test_the_light_is_compared_with_that_of_the_reference(
    lab: VirtualLab, pipeline: Pipeline, gain: float, verdict: str
) -> None:
    scale = np.array([gain, 1.0, 1.0])
    images = [np.rint(image * scale).clip(0, 255).astype(np.uint8) for image in undeformed(lab)]
    red, green, _ = judged(pipeline, images).lights().values()
    assert red.value == pytest.approx(gain, rel=0.02)
    assert green.value == pytest.approx(1, rel=0.02)
    assert (red.verdict, green.verdict) == (verdict, "ok")
    if verdict == "warning":
        way = "brighter" if gain > 1 else "dimmer"
        assert f"channel 'red' is {abs(gain - 1):.0%} {way} than in the reference" in red.message


def test_under_a_contact_the_light_is_that_of_the_undeformed_surface(
    lab: VirtualLab, pipeline: Pipeline
) -> None:
    press = lab.image(BallPress((80.0, 60.0), BALL_MM, 0.8))
    found = judged(pipeline, [np.rint(press * 0.75).astype(np.uint8)]).lights()
    assert [light.value for light in found.values()] == pytest.approx([0.75] * 3, rel=0.03)


def test_saturation_is_that_of_the_latest_frame(lab: VirtualLab, pipeline: Pipeline) -> None:
    bright = undeformed(lab, 2)
    bright[1][:30] = 255
    found = judged(pipeline, bright).judge_saturation()
    assert found.value == pytest.approx(0.25)
    assert found.message == "25% of the frame is saturated; shorten the exposure"


@pytest.mark.parametrize(("seen", "verdict"), [(100, "ok"), (85, "ok"), (70, "warning")])
def test_markers_that_are_seen_are_counted(seen: int, verdict: str) -> None:
    places = np.zeros((100, 2), np.float32)
    shown = np.arange(100) < seen
    field = MarkerField(np.arange(100, dtype=np.int32), places, places, shown, 0.1)
    frame = Frame(np.zeros((4, 4, 3), np.uint8), ("r", "g", "b"), 0.1)
    health = GelHealth()
    health.add(Reading(frame, {MarkerField: field}, {}))
    found = health.markers()
    assert (found.value, found.expected, found.verdict) == (seen, 100, verdict)
    assert (f"{seen} of 100 markers are seen" in found.message) == (verdict == "warning")
