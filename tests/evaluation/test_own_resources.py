"""The memory of a process is its own."""

from collections.abc import Generator
from typing import Any

import numpy as np
import pytest

from tactile_core.evaluation.own_resources import peak_memory_mib
from tactile_core.pipeline.workers import WorkerProcess


def weigh(megabytes: int) -> Generator[Any, None, None]:
    held = np.ones((megabytes, 2**20), np.uint8)
    yield peak_memory_mib() if held.all() else None


def test_memory_is_that_of_the_process_alone() -> None:
    if peak_memory_mib() is None:
        pytest.skip("this system does not report memory")
    parents_own = np.ones((400, 2**20), np.uint8)
    peaks = []
    for megabytes in (10, 110):
        with WorkerProcess(weigh, megabytes) as process:
            peaks.append(process.receive())
    assert peaks[0] < parents_own.nbytes / 2**20
    assert peaks[1] - peaks[0] == pytest.approx(100, abs=10)
