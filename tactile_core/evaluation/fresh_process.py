"""Run work in a separate process, to measure its memory and to give it its own core."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from tactile_core.errors import DeviceError, words_of

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class FreshProcess:
    """A generator that runs in a new interpreter with one thread.

    Unlike a :mod:`multiprocessing` process it shares no memory with this one and does not import
    the caller's script again.

    Parameters
    ----------
    function : callable
        A generator function of a module. :meth:`receive` returns the values that it yields;
        :meth:`send` sets the value of its ``yield`` expression.
    *arguments
        Arguments of the function; they are pickled.
    """

    def __init__(self, function: Callable[..., Generator[Any, Any, None]], *arguments: Any) -> None:
        environment = os.environ | dict.fromkeys(_THREADS, "1")
        environment.setdefault("PYTHONWARNINGS", "ignore")
        environment["PYTHONPATH"] = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"from {__name__} import serve; serve()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            process_group=0,  # only this process gets the terminal's interrupt; it ends the other
        )
        self.send((function, arguments))

    def send(self, message: Any) -> None:
        """Send a message; this does not wait for the other process."""
        assert self._process.stdin is not None
        # receive() reports a process that has ended
        with suppress(BrokenPipeError):
            pickle.dump(message, self._process.stdin)
            self._process.stdin.flush()

    def receive(self) -> Any:
        """Wait for the next value that the generator yields.

        Raises
        ------
        Exception
            The generator's exception, raised again here.
        DeviceError
            The process has ended, for instance because it ran out of memory.
        """
        assert self._process.stdout is not None
        try:
            answer = pickle.load(self._process.stdout)
        except EOFError:
            code = self._process.wait()
            raise DeviceError(
                f"a measuring process ended unexpectedly (exit code {code}); see its output above"
            ) from None
        if isinstance(answer, Exception):
            raise answer
        return answer

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is not None:
            self._process.kill()
        self._process.communicate()


def serve() -> None:
    """Run one generator for the process at the other end of stdin and stdout."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # a plugin's print must not mix with the answers
    try:
        for answer in _answered():
            pickle.dump(answer, answers)
            answers.flush()
    except (BrokenPipeError, KeyboardInterrupt):
        return  # the other process has ended


def _answered() -> Iterator[Any]:
    """Values that the generator yields, one per message, and finally its exception, if any."""
    generator: Generator[Any, Any, None] | None = None
    for message in _messages():
        try:
            if generator is None:
                function, arguments = message
                generator = function(*arguments)
                answer = next(generator)
            else:
                answer = generator.send(message)
        except StopIteration:
            return
        except Exception as error:
            yield error
            return
        except SystemExit as error:
            yield DeviceError(f"a measuring process was ended ({words_of(error)})")
            return
        yield answer


def _messages() -> Iterator[Any]:
    with suppress(EOFError):  # the other process has ended
        while True:
            yield pickle.load(sys.stdin.buffer)


def peak_memory_mib() -> float | None:
    """Peak resident memory of this process, including code and libraries, MiB.

    None on systems with neither ``/proc`` nor :mod:`resource`.
    """
    try:
        # ru_maxrss would include the parent's memory: Linux passes it on to a new process
        status = Path("/proc/self/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) / 1024
    except (OSError, IndexError):
        pass
    try:
        import resource
    except ImportError:
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20


@contextmanager
def one_thread() -> Iterator[None]:
    """Restrict OpenCV to one thread inside the block, as on a robot with other tasks."""
    import cv2

    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)
