"""Images of one's own that no camera of the profile sends: one sentence says what to do."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_core import Frame, Pipeline, Reference, open_sensor
from tactile_core.errors import InputError

SHAPE = 480, 640, 3
IMAGE = np.full(SHAPE, 90, np.uint8)


@pytest.fixture(scope="module")
def pipeline() -> Pipeline:
    return Pipeline("hex_fingertip")


@pytest.mark.parametrize(
    ("image", "sentence"),
    [
        ("press.png", "read a file first"),
        (Path("press.png"), "read a file first"),
        (None, "read a file first"),
        (IMAGE.transpose(2, 0, 1), r"channels first.*transpose\(1, 2, 0\)"),
        (IMAGE[None], r"shape \(1, 480, 640, 3\)"),
        (np.dstack([IMAGE, IMAGE[..., :1]]), r"shape \(480, 640, 4\)"),
        (IMAGE / 255, r"float64 values.*np.rint\(255"),
        (IMAGE > 3, "bool values"),
        (IMAGE[..., 0], "the image is grey"),
    ],
)
def test_what_is_no_camera_image_is_refused_with_its_remedy(
    pipeline: Pipeline, image: Any, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        pipeline.frame(image)


@pytest.mark.parametrize(
    ("frame", "sentence"),
    [
        (IMAGE, r"takes a Frame, not ndarray.*pipeline.frame"),
        (Frame(IMAGE.transpose(2, 0, 1), ("r", "g", "b"), 0.1), "channels first"),
        (Frame(np.float32(IMAGE / 255), ("r", "g", "b"), 0.1), "multiply them by 255"),
    ],
)
def test_what_is_no_frame_is_refused_with_its_remedy(
    pipeline: Pipeline, frame: Any, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        pipeline.process(frame)


def test_an_array_is_no_reference_and_the_message_makes_one(pipeline: Pipeline) -> None:
    for give in (Pipeline, open_sensor):
        with pytest.raises(InputError, match=r"Reference\(np.float32\(frame.pixels\)"):
            give("hex_fingertip", reference=IMAGE)  # type: ignore[operator]
    frame = pipeline.frame(IMAGE)
    reference = Reference(np.float32(frame.pixels), frame.channels, frame.full_scale)
    assert pipeline.with_reference(reference).reference is not None


def test_a_sensor_says_that_its_pipeline_can_be_pickled() -> None:
    with (
        open_sensor("hex_fingertip", sim=True) as sensor,
        pytest.raises(InputError, match=r"give the other process sensor\.pipeline"),
    ):
        pickle.dumps(sensor)
