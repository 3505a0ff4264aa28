"""A worker process answers every message, passes its errors back, and ends when it should."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.pipeline.workers import WorkerProcess


def count(start: int) -> Generator[int, int, None]:
    print("a word that is no answer")
    total = start
    while True:
        total += yield total


def stumble() -> Generator[Any, None, None]:
    raise InputError("the input is of no use")
    yield


def run_dry() -> Generator[Any, None, None]:
    raise EOFError("no data left in file")
    yield


def leave() -> Generator[Any, None, None]:
    raise SystemExit(0)
    yield


def vanish() -> Generator[Any, None, None]:
    import os

    os._exit(3)
    yield


class Unpicklable(Exception):
    """An exception that only this process knows."""

    def __reduce__(self) -> str:
        raise TypeError


def keep_to_itself() -> Generator[Any, None, None]:
    raise Unpicklable("a secret")
    yield


def tidy_up(place: Path) -> Generator[Any, None, None]:
    place.touch()
    try:
        yield
        sleep(60)
    finally:
        place.unlink()


def miss_a_signal(place: Path) -> Generator[Any, None, None]:
    """Wait as one that was signalled between its last instruction and the system's wait."""
    leave = signal.getsignal(signal.SIGTERM)
    signal.signal(signal.SIGTERM, lambda *_: signal.signal(signal.SIGTERM, leave))
    place.touch()
    try:
        yield
        sleep(60)
    finally:
        sleep(0.3)  # a longer release is not cut short by further signals
        place.unlink()


def threads() -> Generator[int, None, None]:
    import cv2

    yield cv2.getNumThreads()


def test_it_answers_each_message() -> None:
    with WorkerProcess(count, 5) as process:
        assert process.receive() == 5
        process.send(3)
        assert process.receive() == 8
        process.send(-8)
        assert process.receive() == 0


def test_its_error_is_raised_here() -> None:
    with pytest.raises(InputError, match="of no use"), WorkerProcess(stumble) as process:
        process.receive()


def test_its_eof_error_is_raised_here() -> None:
    with pytest.raises(EOFError, match="no data left"), WorkerProcess(run_dry) as process:
        process.receive()


def test_its_system_exit_is_reported() -> None:
    with pytest.raises(ChildProcessError, match="SystemExit: 0"), WorkerProcess(leave) as process:
        process.receive()


def test_an_unexpected_end_is_reported() -> None:
    with pytest.raises(ChildProcessError, match="exit code 3"), WorkerProcess(vanish) as process:
        process.receive()


def test_a_message_to_an_ended_process_is_reported_on_receive() -> None:
    with WorkerProcess(vanish) as process:
        for _ in range(3):
            process.send(np.zeros(2**20))
        with pytest.raises(ChildProcessError, match="exit code 3"):
            process.receive()


def test_an_error_that_cannot_be_pickled_is_reported() -> None:
    with (
        pytest.raises(RuntimeError, match="Unpicklable: a secret") as caught,
        WorkerProcess(keep_to_itself) as process,
    ):
        process.receive()
    assert "keep_to_itself" in str(caught.value.__cause__)


@pytest.mark.parametrize(
    ("function", "at_work"), [(tidy_up, True), (tidy_up, False), (miss_a_signal, True)]
)
def test_it_releases_its_resources_when_it_is_ended(
    function: Callable[[Path], Generator[Any, None, None]], at_work: bool, tmp_path: Path
) -> None:
    place = tmp_path / "unfinished"
    with WorkerProcess(function, place) as process:
        process.receive()
        assert place.exists()
        if at_work:
            process.send(None)
    assert not place.exists()


def test_it_ends_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    place = tmp_path / "unfinished"
    code = (
        "import os, signal, pathlib, sys\n"
        "from pipeline.test_worker_process import WorkerProcess, tidy_up\n"
        "process = WorkerProcess(tidy_up, pathlib.Path(sys.argv[1]))\n"
        "process.receive()\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    path = os.pathsep.join([str(Path(__file__).parents[1]), *filter(None, sys.path)])
    environment = os.environ | {"PYTHONPATH": path}
    run = subprocess.run([sys.executable, "-c", code, str(place)], env=environment)
    assert run.returncode == -signal.SIGKILL
    end_s = monotonic() + 10
    while place.exists():
        assert monotonic() < end_s
        sleep(0.01)


def test_its_libraries_use_one_thread() -> None:
    with WorkerProcess(threads) as process:
        assert process.receive() == 1
