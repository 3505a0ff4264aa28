"""Several worker processes give the same readings as one, in order."""

import os
import signal
from collections.abc import Iterator

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core import Frame, HeightMap, Pipeline
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.errors import InputError
from tactile_core.pipeline.workers import shared_out


def frames(lab: VirtualLab, count: int) -> Iterator[Frame]:
    for number in range(count):
        pixels = lab.image(BallPress((60.0 + number, 62.0), BALL_MM, 0.8))
        yield Frame(pixels, ("red", "green", "blue"), 0.1, sequence=number)


def test_two_workers_give_the_readings_of_one_in_order(lab: VirtualLab) -> None:
    # in a fresh installation the first frame takes long, of which its reading warns
    list(Pipeline(lab.profile, lab.bundle).map(frames(lab, 1)))
    serial = list(Pipeline(lab.profile, lab.bundle).map(frames(lab, 6)))
    parallel = list(Pipeline(lab.profile, lab.bundle).map(frames(lab, 6), workers=2))
    assert [reading.frame.sequence for reading in parallel] == list(range(6))
    assert [reading.warnings for reading in parallel] == [reading.warnings for reading in serial]
    for one, other in zip(serial, parallel, strict=True):
        np.testing.assert_allclose(other[HeightMap].mm, one[HeightMap].mm, atol=1e-5)


def test_only_a_few_frames_are_read_ahead(lab: VirtualLab) -> None:
    taken = 0

    def counted() -> Iterator[Frame]:
        nonlocal taken
        for frame in frames(lab, 40):
            taken += 1
            yield frame

    readings = Pipeline(lab.profile, lab.bundle).map(counted(), workers=2)
    for _ in range(3):
        next(readings)
    assert taken <= 3 + 2 * 2
    readings.close()  # type: ignore[attr-defined]


def test_stateful_steps_are_named_as_needing_one_worker() -> None:
    pipeline = Pipeline("hex_fingertip")
    with pytest.raises(InputError, match=r"tracking.*slip; use one worker"):
        next(pipeline.map(iter(()), workers=2))


class Killed:
    """A processor whose process the operating system kills."""

    def process(self, frame: Frame) -> None:
        os.kill(os.getpid(), signal.SIGKILL)


def test_a_killed_worker_is_reported(lab: VirtualLab) -> None:
    with pytest.raises(ChildProcessError, match="fewer workers"):
        list(shared_out(Killed(), frames(lab, 2), 1))  # type: ignore[arg-type]
