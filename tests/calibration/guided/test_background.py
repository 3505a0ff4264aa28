"""What examines and scores beside the live frames answers, and ends with whoever wants it."""

from __future__ import annotations

import os
from contextlib import closing
from multiprocessing import get_context

import pytest

from experiments.virtual_hand import VirtualHand
from tactile_core.acquisition.acquisition import average
from tactile_core.calibration.guided.background import InProcess
from tactile_core.calibration.guided.examination import TouchBench

SMALL = {
    "image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.09},
    "calibration": {"use": "core.polynomial"},
}


def made_bench() -> tuple[TouchBench, VirtualHand]:
    hand = VirtualHand("desktop_three_colour", 200, SMALL)
    reference = average(list(hand.idle(5)))
    return TouchBench.for_sensor(hand.profile, reference, 2 * hand.ball_mm, None), hand


def judge() -> None:
    bench, hand = made_bench()
    (frame,) = hand.idle(1)
    assert InProcess(bench).examine("press_01", frame).result(60).why


def test_work_that_fails_leaves_the_process_as_it_is() -> None:
    with closing(InProcess(made_bench()[0])) as background:
        process = background.run(os.getpid)
        assert process != os.getpid()
        with pytest.raises(ZeroDivisionError):
            background.run(divmod, 1, 0)
        assert background.run(os.getpid) == process


@pytest.mark.parametrize("daemon", [True, False])
def test_a_process_of_multiprocessing_that_leaves_it_open_ends(daemon: bool) -> None:
    process = get_context("spawn").Process(target=judge, daemon=daemon)
    process.start()
    process.join(90)
    try:
        assert process.exitcode == 0
    finally:
        process.kill()
