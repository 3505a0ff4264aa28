"""References from averaged frames, and the frames of a recording."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.virtual_lab import VirtualLab

from tactile_core.acquisition.acquisition import average
from tactile_core.errors import InputError
from tactile_core.pipeline.playback import read_frames
from tactile_core.quantities import Frame


def frame(level: float, shape: tuple[int, int, int] = (4, 5, 3)) -> Frame:
    return Frame(np.full(shape, level, np.float32), ("red", "green", "blue"), 0.1)


@given(st.lists(st.floats(0, 255), min_size=1, max_size=6))
def test_a_reference_is_the_mean_of_its_frames(levels: list[float]) -> None:
    reference = average([frame(level) for level in levels])
    np.testing.assert_allclose(reference.pixels, np.mean(levels), atol=1e-3)
    assert reference.frames == len(levels)


def test_the_noise_is_estimated_from_several_frames() -> None:
    rng = np.random.default_rng(0)
    frames = [
        Frame((100 + rng.normal(0, 2, (60, 80, 3))).astype(np.float32), ("r", "g", "b"), 0.1)
        for _ in range(12)
    ]
    assert average(frames).noise == pytest.approx(2, rel=0.1)


def test_a_reference_needs_at_least_one_frame() -> None:
    with pytest.raises(InputError, match="at least one"):
        average([])


def test_frames_of_different_sizes_are_rejected() -> None:
    with pytest.raises(InputError, match="differ in size"):
        average([frame(1), frame(1, (5, 4, 3))])


def test_frames_are_in_file_order_with_their_names(lab: VirtualLab) -> None:
    frames = list(read_frames(lab.profile, lab.presses))
    assert [f.source for f in frames] == [f"press_{i}" for i in range(10)]
    assert [f.sequence for f in frames] == list(range(10))
    assert frames[0].channels == ("red", "green", "blue")
    assert frames[0].mm_per_px == lab.profile.image.mm_per_px
