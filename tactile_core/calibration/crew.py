"""Processes that share the independent fits of a calibration with this one."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import IO, Any, NamedTuple, Self, TypeVar

T = TypeVar("T")

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

Done = Callable[[float], None]
"""Called with the share of the tasks that is done."""


class Task(NamedTuple):
    """A call that another process may make: a function of a module, and what it is called with."""

    work: Callable[..., Any]
    arguments: tuple[Any, ...]


class Crew:
    """This process and its helpers, which work on independent tasks together.

    A task has the same result wherever it runs. What a helper cannot do, because it was killed or
    because something cannot be pickled, this process does itself; so it does with tasks that fail,
    whose exception is raised here.

    Unlike processes of :mod:`multiprocessing`, helpers do not import the caller's script again.

    Parameters
    ----------
    helpers : int
        Number of further processes. They start at once, and load their code while this process
        goes on. 0 does everything in this process.
    modules : sequence of str
        What they load.
    """

    def __init__(self, helpers: int = 0, modules: Sequence[str] = ()) -> None:
        started = (_Helper.started(modules) for _ in range(helpers))
        self._helpers = [helper for helper in started if helper is not None]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for helper in self._helpers:
            helper.end()

    def run(self, shared: Any, tasks: Sequence[Task], done: Done | None = None) -> list[Any]:
        """Do all tasks.

        Parameters
        ----------
        shared : object
            First argument of every task; it is sent once.
        tasks : sequence of Task
        done : callable, optional

        Returns
        -------
        list
            The results, in the order of the tasks.

        Raises
        ------
        Exception
            A task raised it.
        """
        results: dict[int, Any] = {}
        left = deque(range(len(tasks)))

        def at_home(number: int) -> None:
            results[number] = tasks[number].work(shared, *tasks[number].arguments)
            if done is not None:
                done(len(results) / len(tasks))

        threads = self._threads(shared, tasks, left, results)
        try:
            while (number := _next(left)) is not None:
                at_home(number)
        except BaseException:
            for helper in self._helpers:
                helper.end()
            raise
        finally:
            left.clear()
            for thread in threads:
                thread.join()
        for number in range(len(tasks)):
            if number not in results:
                at_home(number)
        return [results[number] for number in range(len(tasks))]

    def _threads(
        self, shared: Any, tasks: Sequence[Task], left: deque[int], results: dict[int, Any]
    ) -> list[Thread]:
        """Start a thread per helper that hands it tasks."""
        if not self._helpers:
            return []
        try:
            pickled = pickle.dumps((_SHARE, shared), protocol=pickle.HIGHEST_PROTOCOL)
        except Exception:  # whatever a plugin's __reduce__ raises
            return []

        def handed_out(helper: _Helper) -> None:
            with suppress(Exception):  # this process does what is left
                helper.send(pickled)
                while (number := _next(left)) is not None:
                    helper.send(pickle.dumps(tasks[number]))
                    fine, result = helper.receive()
                    if not fine:
                        return
                    results[number] = result

        threads = [Thread(target=handed_out, args=(helper,)) for helper in self._helpers]
        for thread in threads:
            thread.start()
        return threads


def cores() -> int:
    """Number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


ALONE = Crew()
"""This process without helpers."""

_SHARE = "share"
"""Marks the message with the first argument of the tasks that follow."""


def _next(left: deque[int]) -> int | None:
    try:
        return left.popleft()
    except IndexError:
        return None


class _Helper:
    """The other end of :func:`serve`."""

    def __init__(self, process: subprocess.Popen[bytes], to: IO[bytes], of: IO[bytes]) -> None:
        self._process, self._to, self._of = process, to, of

    @classmethod
    def started(cls, modules: Sequence[str]) -> Self | None:
        """Start a process that loads these modules; None where that is not possible."""
        environment = os.environ | dict.fromkeys(_THREADS, "1")
        environment.setdefault("PYTHONWARNINGS", "ignore")
        environment["PYTHONPATH"] = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
        try:
            process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import serve; serve()", *modules],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=environment,
                # only this process gets the terminal's interrupt; it ends the other
                process_group=0 if os.name == "posix" else None,
            )
        except (OSError, ValueError):
            return None
        assert process.stdin is not None
        assert process.stdout is not None
        return cls(process, process.stdin, process.stdout)

    def send(self, pickled: bytes) -> None:
        """Send a message, and wait until it is taken."""
        self._to.write(pickled)
        self._to.flush()

    def receive(self) -> Any:
        """Wait for the answer to a task: whether it succeeded, and its result."""
        return pickle.load(self._of)

    def end(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._to, self._of):
            with suppress(OSError):
                pipe.close()


def serve() -> None:
    """Do the tasks that come by stdin, and answer by stdout."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # a plugin's print must not mix with the answers
    for module in sys.argv[1:]:
        import_module(module)
    if (cv2 := sys.modules.get("cv2")) is not None:  # a helper has one core
        cv2.setNumThreads(1)
    shared: Any = None
    # the other process ends this one; it may have ended itself
    with suppress(EOFError, BrokenPipeError):
        while True:
            work, content = pickle.load(sys.stdin.buffer)
            if work == _SHARE:
                shared = content
                continue
            pickle.dump(_answer(work, shared, content), answers, pickle.HIGHEST_PROTOCOL)
            answers.flush()


def _answer(work: Callable[..., T], shared: Any, arguments: Sequence[Any]) -> tuple[bool, Any]:
    """Whether a task succeeded, and its result."""
    try:
        return True, work(shared, *arguments)
    except Exception:  # the other process repeats the task, and raises it where it is handled
        return False, None
