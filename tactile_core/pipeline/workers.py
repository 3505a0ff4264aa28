"""A few worker processes that share independent tasks."""

from __future__ import annotations

from collections.abc import Callable, Generator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from queue import SimpleQueue
from types import TracebackType
from typing import Any, Self, TypeVar

from tactile_core.pipeline.worker_process import WorkerProcess

T = TypeVar("T")


class Workers:
    """Worker processes, each with a thread of this process that hands it tasks.

    They start at once, and load their code while this process goes on. One that ends unexpectedly
    fails its task and is replaced for the next one.

    Parameters
    ----------
    count : int
        Number of processes.
    function : callable
        Generator function of a module that each runs; see :class:`WorkerProcess`. Its first
        ``yield`` shows that it is ready.
    *arguments
        Arguments of the function; they are pickled.
    """

    def __init__(
        self, count: int, function: Callable[..., Generator[Any, Any, None]], *arguments: Any
    ) -> None:
        self._new = partial(WorkerProcess, function, *arguments)
        self._threads = ThreadPoolExecutor(count)
        self._idle = SimpleQueue[WorkerProcess | None]()
        self._begun: list[WorkerProcess] = []
        self._ended = False
        for _ in range(count):
            self._idle.put(None)
            self.submit(lambda worker: None)

    def submit(self, task: Callable[[WorkerProcess], T]) -> Future[T]:
        """Call a function with the next idle process, in a thread.

        Returns
        -------
        Future
            Raises :class:`ChildProcessError` if the process ended.
        """
        return self._threads.submit(self._done, task)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End all processes, whatever they do."""
        self._ended = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for worker in self._begun:
            worker.end()
        self._threads.shutdown()

    def _done(self, task: Callable[[WorkerProcess], T]) -> T:
        worker = self._idle.get()
        try:
            worker = worker or self._started()
            result = task(worker)
        except Exception:
            if worker is not None:
                worker.end()
            self._idle.put(None)
            raise
        self._idle.put(worker)
        return result

    def _started(self) -> WorkerProcess:
        worker = self._new()
        self._begun.append(worker)
        if self._ended:  # meanwhile
            worker.end()
        worker.receive()
        return worker
