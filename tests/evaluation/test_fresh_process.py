"""A fresh process has its own memory, answers every message and passes its errors back."""

from collections.abc import Generator
from typing import Any

import numpy as np
import pytest

from tactile_core.errors import DeviceError, InputError
from tactile_core.evaluation.fresh_process import FreshProcess, peak_memory_mib


def count(start: int) -> Generator[int, int, None]:
    print("a word that is no answer")
    total = start
    while True:
        total += yield total


def weigh(megabytes: int) -> Generator[Any, None, None]:
    held = np.ones((megabytes, 2**20), np.uint8)
    yield peak_memory_mib() if held.all() else None


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


def test_it_answers_each_message() -> None:
    with FreshProcess(count, 5) as process:
        assert process.receive() == 5
        process.send(3)
        assert process.receive() == 8
        process.send(-8)
        assert process.receive() == 0


def test_its_error_is_raised_here() -> None:
    with pytest.raises(InputError, match="of no use"), FreshProcess(stumble) as process:
        process.receive()


def test_its_eof_error_is_raised_here() -> None:
    with pytest.raises(EOFError, match="no data left"), FreshProcess(run_dry) as process:
        process.receive()


def test_its_system_exit_is_reported() -> None:
    with pytest.raises(DeviceError, match="SystemExit: 0"), FreshProcess(leave) as process:
        process.receive()


def test_an_unexpected_end_is_reported() -> None:
    with pytest.raises(DeviceError, match="exit code 3"), FreshProcess(vanish) as process:
        process.receive()


def test_a_message_to_an_ended_process_is_reported_on_receive() -> None:
    with FreshProcess(vanish) as process:
        for _ in range(3):
            process.send(np.zeros(2**20))
        with pytest.raises(DeviceError, match="exit code 3"):
            process.receive()


def test_memory_is_that_of_the_process_alone() -> None:
    if peak_memory_mib() is None:
        pytest.skip("this system does not report memory")
    parents_own = np.ones((400, 2**20), np.uint8)
    peaks = []
    for megabytes in (10, 110):
        with FreshProcess(weigh, megabytes) as process:
            peaks.append(process.receive())
    assert peaks[0] < parents_own.nbytes / 2**20
    assert peaks[1] - peaks[0] == pytest.approx(100, abs=10)
