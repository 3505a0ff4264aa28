"""A tenth of the bad inputs and faults that ``make fuzz`` tries, the same ones every time."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor

import pytest
from fuzz import crew
from fuzz.areas import AREAS

_SHARE, _SEED = 10, 0


@pytest.fixture(scope="module")
def worker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ProcessPoolExecutor]:
    """One process that has imported everything, for each process of the tests."""
    patch = pytest.MonkeyPatch()
    # compiling takes longer than all of the cases
    patch.setenv("TACTILE_FAST", "0")
    with crew.crew(1, tmp_path_factory.mktemp("fuzz")) as pool:
        yield pool
    patch.undo()


@pytest.mark.parametrize("area", AREAS)
def test_bad_inputs_and_faults_break_no_promise(area: str, worker: ProcessPoolExecutor) -> None:
    numbers = range(-(-AREAS[area][1] // _SHARE))
    results = worker.submit(crew.try_some, area, numbers, _SEED).result()
    broken = [
        f"make fuzz FUZZ='--case {result.case}': {promise}\n{result.said}"
        for result in results
        for promise in result.broken
    ]
    assert not broken, "\n\n".join(broken)
