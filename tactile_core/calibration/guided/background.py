"""Work that must not delay live frames, in processes of its own or, for tests, at once."""

# NumPy is imported in the new processes, after the number of its threads is set.
from __future__ import annotations

import os
import pickle
import signal
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, TypeVar

from tactile_core.pipeline.one_thread import ONE_THREAD

if TYPE_CHECKING:
    from tactile_core.algorithms.circles import Circle
    from tactile_core.calibration.guided.bench import Bench
    from tactile_core.calibration.guided.examination import Verdict
    from tactile_core.quantities import Frame

P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def naming_a_kill() -> Iterator[None]:
    """Say in words that a process was killed.

    Raises
    ------
    ChildProcessError
        A process of the background was killed.
    """
    try:
        yield
    except BrokenProcessPool as error:
        raise ChildProcessError(
            "a process that judges presses was killed, perhaps because memory ran out; the session "
            "so far is recorded: fit it with 'tactile calibrate --presses'"
        ) from error


class Background(Protocol):
    """Examines and scores presses beside the live frames."""

    def examine(self, name: str, frame: Frame) -> Future[Verdict]:
        """Judge a still frame, together with those kept before."""

    def score(
        self, kept: Mapping[str, Frame], before: Mapping[str, Circle]
    ) -> Future[float | None]:
        """Score the last of these presses with a calibration on all before it."""

    def run(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run the final fit, and wait for it."""

    def close(self) -> None:
        """Give up what is unfinished."""


class AtOnce:
    """Does all work in the call itself: for tests and simulated time."""

    def __init__(self, bench: Bench) -> None:
        from tactile_core.calibration.guided.examination import Examiner
        from tactile_core.calibration.guided.prequential import Scorer

        self._examiner, self._scorer = Examiner(bench), Scorer(bench)

    def examine(self, name: str, frame: Frame) -> Future[Verdict]:
        """Judge a still frame."""
        return _done(self._examiner.examine, name, frame)

    def score(
        self, kept: Mapping[str, Frame], before: Mapping[str, Circle]
    ) -> Future[float | None]:
        """Score the last of these presses."""
        return _done(self._scorer.score, kept, before)

    def run(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run the final fit."""
        return work(*args, **kwargs)

    def close(self) -> None:
        """Do nothing: all work is done."""


class InProcesses:
    """Examines in one process and scores in another.

    A thread would delay live frames, because Python runs one thread at a time.
    """

    def __init__(self, bench: Bench) -> None:
        pickled = pickle.dumps(bench)
        self._examiner, self._scorer = (
            # "spawn": a forked process would inherit locks that it can never release
            ProcessPoolExecutor(1, get_context("spawn"), initializer=_begin, initargs=(pickled,))
            for _ in range(2)
        )

    def examine(self, name: str, frame: Frame) -> Future[Verdict]:
        """Judge a still frame."""
        return self._examiner.submit(_examined, name, frame)

    def score(
        self, kept: Mapping[str, Frame], before: Mapping[str, Circle]
    ) -> Future[float | None]:
        """Score the last of these presses."""
        return self._scorer.submit(_scored, dict(kept), dict(before))

    def run(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run the final fit in the process of the examination."""
        return self._examiner.submit(work, *args, **kwargs).result()

    def close(self) -> None:
        """Give up what is unfinished."""
        for pool in (self._examiner, self._scorer):
            pool.shutdown(wait=False, cancel_futures=True)


_mine: list[AtOnce] = []
"""The work of this process; a pool's initializer can set it only globally."""


def _begin(pickled: bytes) -> None:
    # Ctrl-C is handled by the process that reads the camera
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # several threads would only compete with the live chain
    os.environ.update(ONE_THREAD)
    _mine[:] = [AtOnce(pickle.loads(pickled))]


def _examined(name: str, frame: Frame) -> Verdict:
    return _mine[0].examine(name, frame).result()


def _scored(kept: Mapping[str, Frame], before: Mapping[str, Circle]) -> float | None:
    return _mine[0].score(kept, before).result()


def _done(work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
    future: Future[Any] = Future()
    try:
        future.set_result(work(*args, **kwargs))
    except Exception as error:  # as a process would hand it on
        future.set_exception(error)
    return future
