import operator
import os
import signal
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from time import sleep

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.calibration import fitting
from tactile_core.calibration.crew import Crew, Task
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.result import Calibrated

ADDED = [Task(operator.add, (number,)) for number in range(40)]


@pytest.mark.parametrize("helpers", [0, 2])
def test_results_come_in_the_order_of_the_tasks(helpers: int) -> None:
    shares: list[float] = []
    with Crew(helpers) as crew:
        assert crew.run(100, ADDED, shares.append) == list(range(100, 140))
        assert crew.run([7], [Task(operator.getitem, (0,))] * 3) == [7, 7, 7]
    assert shares == sorted(shares)


@pytest.mark.parametrize("helpers", [0, 1])
def test_a_task_that_fails_raises_its_exception(helpers: int) -> None:
    with Crew(helpers) as crew, pytest.raises(ZeroDivisionError):
        crew.run(1, [*ADDED, Task(operator.truediv, (0,))])


def test_what_cannot_be_sent_is_done_here() -> None:
    with Crew(1) as crew:
        assert crew.run(lambda: None, [Task(callable, ())] * 3) == [True] * 3


def kill_helper(home: int) -> None:
    if os.getpid() != home:
        os.kill(os.getpid(), signal.SIGKILL)
    sleep(0.5)  # leaves the others to the helpers


def test_helpers_that_were_killed_are_replaced_by_this_process() -> None:
    with Crew(2) as crew:
        assert crew.run(os.getpid(), [Task(kill_helper, ())] * 4) == [None] * 4
        assert crew.run(0, ADDED) == list(range(40))


def test_a_process_that_cannot_be_started_is_not_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.executable", "/nowhere/python")
    with Crew(2) as crew:
        assert crew.run(0, ADDED) == list(range(40))


def sums(shared: int) -> list[int]:
    with Crew(1) as crew:
        return crew.run(shared, ADDED)


def test_a_process_of_a_pool_may_have_helpers() -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        assert pool.submit(sums, 2).result() == list(range(2, 42))


def test_several_processes_find_the_same_calibration(
    lab: VirtualLab, monkeypatch: pytest.MonkeyPatch
) -> None:
    def made(workers: int) -> Calibrated:
        return calibrate(
            lab.profile,
            lab.presses,
            lab.reference,
            ball_diameter_mm=BALL_MM,
            model="core.polynomial",
            workers=workers,
        )

    alone = made(1)
    monkeypatch.setattr(fitting, "_FEWEST_SHARED", 2)
    shared = made(2)
    assert [p.circle for p in shared.presses] == [p.circle for p in alone.presses]
    assert alone.score is not None
    assert shared.score is not None
    assert shared.score.summary() == alone.score.summary()
    np.testing.assert_array_equal(shared.score.samples, alone.score.samples)
    first, second = (one.bundle.artefacts["light"].slopes.function for one in (alone, shared))
    np.testing.assert_array_equal(first.coefficients, second.coefficients)
