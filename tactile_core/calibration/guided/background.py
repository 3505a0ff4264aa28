"""Work that must not delay live frames, in processes of its own or, for tests, at once."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from operator import methodcaller
from traceback import format_exception
from typing import Any, ParamSpec, TypeVar

from tactile_core.algorithms.circles import Circle
from tactile_core.calibration.guided.bench import Bench
from tactile_core.calibration.guided.examination import Examiner, Verdict
from tactile_core.calibration.guided.prequential import Scorer
from tactile_core.pipeline.worker_process import WorkerProcess
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
    except ChildProcessError as error:
        raise ChildProcessError(
            "a process that judges presses was killed, perhaps because memory ran out; the session "
            "so far is recorded: fit it with 'tactile calibrate --presses'"
        ) from error


class AtOnce:
    """Does all work in the call itself: for tests and simulated time."""

    def __init__(self, bench: Bench) -> None:
        self._examiner, self._scorer = Examiner(bench), Scorer(bench)

    def examine(self, name: str, frame: Frame) -> Future[Verdict]:
        """Judge a still frame, together with those kept before."""
        return _done(self._examiner.examine, name, frame)

    def score(
        self, kept: Mapping[str, Frame], before: Mapping[str, Circle]
    ) -> Future[float | None]:
        """Score the last of these presses with a calibration on all before it."""
        return _done(self._scorer.score, kept, before)

    def run(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run the final fit, and wait for it."""
        return work(*args, **kwargs)

    def close(self) -> None:
        """Do nothing: all work is done."""


class InProcesses:
    """Examines in one process and scores in another, and otherwise does as :class:`AtOnce`.

    A thread would delay live frames, because Python runs one thread at a time.
    """

    def __init__(self, bench: Bench) -> None:
        pickled = pickle.dumps(bench)
        self._examiner, self._scorer = _Beside(pickled), _Beside(pickled)

    def examine(self, name: str, frame: Frame) -> Future[Verdict]:
        """Judge a still frame, together with those kept before."""
        return self._examiner.asked("examine", name, frame)

    def score(
        self, kept: Mapping[str, Frame], before: Mapping[str, Circle]
    ) -> Future[float | None]:
        """Score the last of these presses with a calibration on all before it."""
        return self._scorer.asked("score", dict(kept), dict(before))

    def run(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run the final fit in the process of the examination, and wait for it."""
        fitted: T = self._examiner.asked("run", work, *args, **kwargs).result()
        return fitted

    def close(self) -> None:
        """Give up what is unfinished."""
        self._examiner.close()
        self._scorer.close()


class _Beside:
    """An :class:`AtOnce` in another process, and a thread that asks it."""

    def __init__(self, pickled: bytes) -> None:
        self._worker = WorkerProcess(_working, pickled)
        self._thread = ThreadPoolExecutor(1)
        self._thread.submit(self._worker.receive)  # it is ready

    def asked(self, name: str, *args: Any, **kwargs: Any) -> Future[Any]:
        return self._thread.submit(self._answer, methodcaller(name, *args, **kwargs))

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)
        self._worker.end()

    def _answer(self, call: Callable[[AtOnce], Any]) -> Any:
        answer = self._worker.ask(call)
        if isinstance(answer, Exception):
            raise answer
        return answer


def _working(pickled: bytes) -> Generator[Any, Callable[[AtOnce], Any], None]:
    """Make the calls that come; one that fails loses nothing of what was judged before."""
    at_once = AtOnce(pickle.loads(pickled))
    call = yield None
    while True:
        try:
            answer = call(at_once)
            answer = answer.result() if isinstance(answer, Future) else answer
        except Exception as error:
            error.add_note("".join(format_exception(error)))
            answer = error
        call = yield answer


def _done(work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
    future: Future[Any] = Future()
    try:
        future.set_result(work(*args, **kwargs))
    except Exception as error:  # as a process would hand it on
        future.set_exception(error)
    return future
