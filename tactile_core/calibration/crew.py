"""This process and worker processes share the independent fits of a calibration."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple

from tactile_core.interfaces.device import Closing
from tactile_core.pipeline.workers import WorkerProcess, Workers

Done = Callable[[float], None]  # Called with the share of the tasks that is done


class Task(NamedTuple):
    """A call that another process may make: a function of a module, and what it is called with."""

    work: Callable[..., Any]
    arguments: tuple[Any, ...]


class Crew(Closing):
    """This process and its helpers, which work on independent tasks together.

    A task has the same result wherever it runs. What a helper cannot do, because it was killed or
    because something cannot be pickled, this process does itself; so it does with tasks that fail,
    whose exception is raised here.

    Parameters
    ----------
    helpers : int
        Number of further processes. They start at once, and load their code while this process
        goes on. 0 does everything in this process.
    modules : sequence of str
        What they load.
    """

    def __init__(self, helpers: int = 0, modules: Sequence[str] = ()) -> None:
        self._helpers = Workers(helpers, _helping, tuple(modules)) if helpers else None

    def close(self) -> None:
        """End the helpers."""
        if self._helpers is not None:
            self._helpers.close()

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
        given = self._offer_tasks(shared, tasks)
        results: dict[int, Any] = {}

        def at_home(number: int) -> None:
            results[number] = tasks[number].work(shared, *tasks[number].arguments)
            elsewhere = sum(one.done() and not one.cancelled() for one in given)
            if done is not None:
                done(min(1.0, (len(results) + elsewhere) / len(tasks)))

        try:
            for number in range(len(tasks)):
                if not given or given[number].cancel():
                    at_home(number)
        finally:
            for one in given:
                one.cancel()
        for number, one in enumerate(given):
            if number not in results:
                try:
                    results[number] = one.result()
                except Exception:  # raised here if it is the task's own
                    at_home(number)
        return [results[number] for number in range(len(tasks))]

    def _offer_tasks(self, shared: Any, tasks: Sequence[Task]) -> list[Future[Any]]:
        """Offer the tasks to the helpers, which take those that are not cancelled."""
        if self._helpers is None:
            return []
        try:
            pickled = pickle.dumps(shared, pickle.HIGHEST_PROTOCOL)
        except Exception:  # whatever a plugin's __reduce__ raises
            return []
        informed: set[WorkerProcess] = set()

        def helped(task: Task, helper: WorkerProcess) -> Any:
            if helper not in informed:
                helper.ask(pickled)
                informed.add(helper)
            return helper.ask(task)

        return [self._helpers.submit(partial(helped, task)) for task in tasks]


ALONE = Crew()  # This process without helpers


def _helping(modules: Sequence[str]) -> Generator[Any, Task | bytes, None]:
    """Load modules; do the tasks that come, with the first argument that came before them."""
    for module in modules:
        import_module(module)
    shared = answer = None
    while True:
        message = yield answer
        if isinstance(message, bytes):
            shared, answer = pickle.loads(message), None
        else:
            answer = message.work(shared, *message.arguments)
