"""Work in a process of its own, so that its memory and its processor core are its own too."""

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
    """A generator that runs in a fresh interpreter, one thread wide.

    Unlike a process of :mod:`multiprocessing` it shares nothing with this one and does not run the
    caller's script again.

    Parameters
    ----------
    function : callable
        A generator function of a module; what it yields is received here, what is sent from here
        is the value of its ``yield``.
    *arguments
        Pickled for it.
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
            process_group=0,  # an interrupt from the terminal is for this process, which ends it
        )
        self.send((function, arguments))

    def send(self, message: Any) -> None:
        """Send a message; the other side does not have to be ready for it."""
        assert self._process.stdin is not None
        # one that has died says so when its answer is waited for
        with suppress(BrokenPipeError):
            pickle.dump(message, self._process.stdin)
            self._process.stdin.flush()

    def receive(self) -> Any:
        """Wait for what the generator yields next.

        Raises
        ------
        Exception
            What the generator raised.
        DeviceError
            The process has ended, for instance for want of memory.
        """
        assert self._process.stdout is not None
        try:
            answer = pickle.load(self._process.stdout)
        except EOFError:
            code = self._process.wait()
            raise DeviceError(
                f"a measuring process ended by itself (exit code {code}); see what it wrote above"
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
    os.dup2(2, 1)  # a plugin that prints must not spoil the answers
    try:
        for answer in _answered():
            pickle.dump(answer, answers)
            answers.flush()
    except (BrokenPipeError, KeyboardInterrupt):
        return  # the other end has gone


def _answered() -> Iterator[Any]:
    """What the generator yields, one answer for each message; at last what it raises."""
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
    with suppress(EOFError):  # the other end has gone
        while True:
            yield pickle.load(sys.stdin.buffer)


def peak_memory_mib() -> float | None:
    """Largest resident memory that this process ever had, code and libraries included.

    None where the system does not tell (neither ``/proc`` nor :mod:`resource`).
    """
    try:
        # ru_maxrss would count the parent's memory too: Linux hands it down to a new process
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
    """Let OpenCV use one thread for a while, as a robot with other work would."""
    import cv2

    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)
