"""Work in other processes: a pool, a process that answers, and frames that are shared out."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, suppress
from functools import partial
from itertools import islice
from pathlib import Path
from queue import SimpleQueue
from traceback import format_exception
from typing import Any, NamedTuple, Protocol, TypeVar

from tactile_core.errors import InputError, words_of
from tactile_core.interfaces.device import Closing
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.one_thread import ONE_THREAD
from tactile_core.quantities import Frame


def available_cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class WorkerProcess(Closing):
    """A generator that runs in a new interpreter with one thread.

    Unlike a process of :mod:`multiprocessing` it does not import the caller's script again, it ends
    with this process, however that ends, and what it prints goes to the standard error stream. The
    terminal's interrupt reaches only this process.

    Parameters
    ----------
    function : callable
        A generator function of a module. :meth:`receive` returns the values that it yields;
        :meth:`send` sets the value of its ``yield`` expression.
    *arguments
        Arguments of the function; they are pickled.

    Raises
    ------
    OSError
        The system starts no further process.
    """

    def __init__(self, function: Callable[..., Generator[Any, Any, None]], *arguments: Any) -> None:
        environment = os.environ | ONE_THREAD
        environment.setdefault("PYTHONWARNINGS", "ignore")
        environment["PYTHONPATH"] = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
        begin = pickle.dumps((function, arguments), pickle.HIGHEST_PROTOCOL)
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"from {__name__} import serve; serve()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            process_group=0 if os.name == "posix" else None,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._of = self._process.stdin, self._process.stdout
        self._unanswered = 0
        self._write(begin)

    def send(self, message: Any) -> None:
        """Send a message, without waiting for its answer."""
        self._write(pickle.dumps(message, pickle.HIGHEST_PROTOCOL))

    def receive(self) -> Any:
        """Wait for the next value that the generator yields.

        Raises
        ------
        Exception
            The generator's exception, raised again here.
        ChildProcessError
            The process has ended, for instance because it ran out of memory.
        """
        try:
            answer = pickle.load(self._of)
        except (EOFError, pickle.UnpicklingError):
            raise ChildProcessError(
                f"a worker process ended unexpectedly (exit code {self._process.wait()}), perhaps "
                f"because memory ran out; see its output above"
            ) from None
        self._unanswered -= 1
        if isinstance(answer, _Failure):
            raise answer.error from RuntimeError(f"in a worker process:\n{answer.traceback}")
        return answer

    def ask(self, message: Any) -> Any:
        """Send a message, and wait for its answer as :meth:`receive` does."""
        self.send(message)
        return self.receive()

    def close(self) -> None:
        """End the process. One that is at work is interrupted, and may release its resources."""
        at_work = self._unanswered > 0
        if not at_work:
            self._close_pipe(self._to)
        for _ in range(50):  # 5 s in which it should release its resources
            if at_work:  # again: one that begins to wait just then does not hear the first signal
                self._process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(0.1)
                break
        else:
            self._process.kill()
            self._process.wait()
        # only now: a thread may have waited for an answer
        self._close_pipe(self._to)
        self._close_pipe(self._of)

    def _write(self, pickled: bytes) -> None:
        self._unanswered += 1
        # receive() reports a process that has ended
        with suppress(BrokenPipeError):
            self._to.write(pickled)
            self._to.flush()

    @staticmethod
    def _close_pipe(pipe: Any) -> None:
        with suppress(OSError):  # what could not be written is not needed
            pipe.close()


class _Failure(NamedTuple):
    """The exception that ended a generator, and where it came from."""

    error: Exception
    traceback: str


def serve() -> None:
    """Run one generator for the process at the other end of stdin and stdout."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _leave)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # a plugin's print must not mix with the answers
    with (
        suppress(BrokenPipeError),
        closing(_answer_messages()) as answered,
    ):  # the other one has ended
        for answer in answered:
            answers.write(answer)
            answers.flush()


def _leave(*_: object) -> None:
    """End this process in order, so that the generator releases what it holds."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a second signal must not cut that short
    sys.exit(1)


def _answer_messages() -> Generator[bytes, None, None]:
    """Values that the generator yields, one per message, and finally its exception, if any."""
    messages = _messages()
    try:
        function, arguments = next(messages)
        with closing(function(*arguments)) as generator:
            yield _pickle_value(next(generator))
            for message in messages:
                yield _pickle_value(generator.send(message))
    except StopIteration:
        return
    except Exception as error:
        yield _pickle_failure(error)
    except SystemExit as error:
        yield _pickle_failure(ChildProcessError(f"a worker process was ended ({words_of(error)})"))


def _pickle_failure(error: Exception) -> bytes:
    traceback = "".join(format_exception(error))
    try:
        return _pickle_value(_Failure(error, traceback))
    except Exception:  # of a class that cannot be pickled
        return _pickle_value(_Failure(RuntimeError(words_of(error)), traceback))


def _pickle_value(value: Any) -> bytes:
    return pickle.dumps(value, pickle.HIGHEST_PROTOCOL)


def _messages() -> Iterator[Any]:
    with suppress(EOFError):  # the other process has ended
        while True:
            yield pickle.load(sys.stdin.buffer)


T = TypeVar("T")


def answer_each(work: Callable[[Any], Any]) -> Generator[Any, Any, None]:
    """Answer each message that comes by what the function makes of it."""
    answer = None
    while True:
        answer = work((yield answer))


class Workers(Closing):
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

    def ask(self, message: Any) -> Future[Any]:
        """Send a message to the next idle process, and return its answer when it comes."""
        return self.submit(lambda worker: worker.ask(message))

    def close(self) -> None:
        """End all processes, whatever they do."""
        self._ended = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for worker in self._begun:
            worker.close()
        self._threads.shutdown()

    def _done(self, task: Callable[[WorkerProcess], T]) -> T:
        worker = self._idle.get()
        try:
            worker = worker or self._start_worker()
            result = task(worker)
        except Exception:
            if worker is not None:
                worker.close()
            self._idle.put(None)
            raise
        self._idle.put(worker)
        return result

    def _start_worker(self) -> WorkerProcess:
        worker = self._new()
        self._begun.append(worker)
        if self._ended:  # meanwhile
            worker.close()
        worker.receive()
        return worker


class Processor(Protocol):
    """The part of a pipeline that a worker uses; a pipeline itself imports this module."""

    def process(self, frame: Frame) -> Reading:
        """Measure one frame."""


def check_any_order(*, tare: bool, inputs: bool, turns: bool) -> None:
    """Check that frames may be measured in any order.

    Parameters
    ----------
    tare, inputs : bool
        Whether there is a tare, or there are external inputs.
    turns : bool
        Whether a recording has a tare or a new reference.

    Raises
    ------
    InputError
        They may not.
    """
    if tare:
        raise InputError("a tare needs the frames in order; use one worker")
    if inputs:
        raise InputError("external inputs need the frames in order; use one worker")
    if turns:
        raise InputError(
            "the recording has a tare or a new reference, which need the frames in order; "
            "use one worker"
        )


def shared_out(processor: Processor, frames: Iterable[Frame], workers: int) -> Iterator[Reading]:
    """Yield the readings of frames in order, measured by several processes.

    Each process has its own copy of the processor, so a frame cannot depend on earlier ones.

    Raises
    ------
    ChildProcessError
        A worker was killed.
    """
    left, waiting = iter(frames), deque[Future[Reading]]()
    try:
        with Workers(workers, answer_each, processor.process) as crew:
            while True:
                room = 2 * workers - len(waiting)  # [frames] enough that none is idle
                for frame in islice(left, room):
                    waiting.append(crew.ask(frame))
                if not waiting:
                    return
                yield waiting.popleft().result()
    except ChildProcessError as error:
        raise ChildProcessError(
            "a worker process was killed, perhaps because memory ran out; use fewer workers"
        ) from error
