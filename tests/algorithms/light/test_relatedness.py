"""Whether neighbouring images belong to one motion."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest

from tactile_core.algorithms.light.sequence import are_unrelated
from tactile_core.recordings.recording import open_recording


def scene(x: float, y: float, level: float = 60.0, seed: int = 0) -> Any:
    """An imprint on a grey gel, with the noise of a camera."""
    rows, columns = np.mgrid[:240, :320]
    imprint = level * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * 40**2))
    noise = np.random.default_rng(seed).normal(0, 3, (240, 320))
    return np.clip(120 + imprint + noise, 0, 255).astype(np.uint8)


def in_pairs(images: list[Any]) -> list[tuple[Any, Any]]:
    return list(pairwise(images))


def test_presses_at_other_places_are_unrelated() -> None:
    rng = np.random.default_rng(1)
    places = rng.uniform([40, 40], [280, 200], (12, 2))
    assert are_unrelated(in_pairs([scene(x, y, seed=n) for n, (x, y) in enumerate(places)]))


@pytest.mark.parametrize("step_px", [2, 10, 25])
def test_an_imprint_that_moves_is_one_motion(step_px: float) -> None:
    moving = [scene(40 + step_px * n, 120, min(60, 20 * n), seed=n) for n in range(10)]
    assert not are_unrelated(in_pairs(moving))


def test_an_object_that_jumps_now_and_then_is_one_motion() -> None:
    jumps = [scene([60, 200, 120, 260][n // 3], 120, seed=n) for n in range(12)]
    assert not are_unrelated(in_pairs(jumps))


def test_an_image_alone_shows_no_motion_and_a_gel_at_rest_is_none() -> None:
    assert are_unrelated([])
    assert not are_unrelated([(scene(60, 60), scene(200, 150))])  # of two nobody can know
    assert not are_unrelated(in_pairs([scene(100, 100, 0, seed=n) for n in range(8)]))


def test_light_that_drifts_does_not_count() -> None:
    drifting = [cv2.add(scene(100, 100, 0, seed=n), 3.0 * (n % 5)) for n in range(10)]
    assert not are_unrelated(in_pairs(drifting))


def test_recorded_presses_are_unrelated_and_lifts_are_motions(recordings: Any) -> None:
    def standalone(place: str) -> bool:
        (first, *_) = open_recording(recordings / place)
        return first.images[0].standalone

    for place in ("wedge", "wedge_2/presses", "objectfolder/presses"):
        assert standalone(f"three_colour/{place}")
    assert standalone("gelsight_mini/ball_presses")
    assert standalone("digit/ball_presses")
    assert not standalone("markers/mini/frames")
    for lift in sorted((recordings / "slip" / "grasp_lift").glob("object*/*_mm"))[::7]:
        assert not standalone(str(lift.relative_to(recordings)))
