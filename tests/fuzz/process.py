"""Runs an attempt in forked processes, with its own files, limits, streams and faults."""

from __future__ import annotations

import json
import os
import resource
import selectors
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fuzz.attempt import Attempt
from fuzz.sandbox import Sandbox

WALL_S = 90.0
"""Longest duration of a process, s."""

BLOCKED_S = 20.0
"""Time after which a process without work counts as blocked, s."""

_MEMORY_BYTES = 4 << 30
"""Limit of the address space, bytes."""

_KEPT_BYTES = 1 << 20
"""Largest kept part of a stream, bytes."""

_OURS = f"{os.sep}tactile_"


@dataclass(frozen=True)
class Outcome:
    """The exit status and the output of a process.

    Attributes
    ----------
    code : int
        Exit status, or the negative number of a signal.
    report : mapping
        ``raised``: type, message and place of a call's exception; ``fired``: the operation with
        the injected fault.
    """

    code: int
    stdout: bytes
    stderr: bytes
    report: Mapping[str, Any]
    cpu_s: float
    peak_mib: float
    hung: bool


@dataclass
class _Child:
    pid: int
    streams: dict[int, str]
    kept: dict[str, bytearray] = field(default_factory=dict)


def run(attempt: Attempt, box: Sandbox) -> list[Outcome]:
    """Run the attempt in ``attempt.times`` concurrent processes."""
    children = [_start(attempt, box) for _ in range(attempt.times)]
    return [_finish(child, attempt) for child in children]


def _start(attempt: Attempt, box: Sandbox) -> _Child:
    pipes = {name: os.pipe() for name in ("stdout", "stderr", "report")}
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid == 0:
        writing = {name: pipe[1] for name, pipe in pipes.items()}
        try:
            for reading, _ in pipes.values():
                os.close(reading)
            _be_the_child(attempt, box, writing)
        except BaseException:
            # a fault of the harness
            os.write(writing["report"], json.dumps({"harness": traceback.format_exc()}).encode())
        finally:
            os._exit(99)
    for _, writing in pipes.values():
        os.close(writing)
    streams = {pipe[0]: name for name, pipe in pipes.items()}
    gone = f"{attempt.wires.removesuffix('-gone')}" if attempt.wires.endswith("-gone") else ""
    for reading in [one for one, name in streams.items() if name == gone]:
        os.close(reading)
        del streams[reading]
    return _Child(pid, streams, {name: bytearray() for name in pipes})


def _finish(child: _Child, attempt: Attempt) -> Outcome:
    begun, hung, sent = time.monotonic(), False, False
    with selectors.DefaultSelector() as ready:
        for stream in child.streams:
            ready.register(stream, selectors.EVENT_READ)
        while ready.get_map():
            for key, _ in ready.select(0.02):
                data = os.read(key.fd, 1 << 16)
                if data:
                    kept = child.kept[child.streams[key.fd]]
                    kept += data[: max(0, _KEPT_BYTES - len(kept))]
                else:
                    ready.unregister(key.fd)
                    os.close(key.fd)
            elapsed = time.monotonic() - begun
            if attempt.signal is not None and not sent and elapsed > attempt.signal[1]:
                os.kill(child.pid, attempt.signal[0])
                sent = True
            if not hung and _hangs(child.pid, elapsed):
                hung = True
                os.killpg(child.pid, signal.SIGKILL)
    _, status, usage = os.wait4(child.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    report: dict[str, Any] = {}
    for line in bytes(child.kept["report"]).splitlines():
        report.update(json.loads(line))
    base_mib = 0.0 if attempt.alone else _resident_mib()
    return Outcome(
        code,
        bytes(child.kept["stdout"]),
        bytes(child.kept["stderr"]),
        report,
        usage.ru_utime + usage.ru_stime,
        usage.ru_maxrss / 1024 - base_mib,
        hung or code == -signal.SIGXCPU,
    )


def _hangs(pid: int, elapsed_s: float) -> bool:
    """Return whether a process, with those that it started, is blocked or takes too long."""
    if elapsed_s < BLOCKED_S:
        return False
    ticks = 0
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has just ended
            _, _, group, *numbers = (process / "stat").read_text().rpartition(")")[2].split()
            ticks += sum(map(int, numbers[8:10])) if int(group) == pid else 0
    return ticks < os.sysconf("SC_CLK_TCK") or elapsed_s > WALL_S


def _resident_mib() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def _be_the_child(attempt: Attempt, box: Sandbox, pipes: Mapping[str, int]) -> None:
    os.setpgid(0, 0)
    os.chdir(box.work)
    os.environ.update(box.environment() | attempt.environment)
    tempfile.tempdir = None
    resource.setrlimit(resource.RLIMIT_CPU, (attempt.cpu_s, attempt.cpu_s + 5))
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    full = os.open("/dev/full", os.O_WRONLY)
    for number, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(full if attempt.wires == f"{name}-full" else pipes[name], number)
        if attempt.wires == f"{name}-closed":
            os.close(number)
    if attempt.alone:
        for name in ("stdout", "stderr"):
            os.close(pipes[name])
        os.set_inheritable(pipes["report"], False)
        words = [sys.executable, "-m", "tactile_core.cli", *attempt.words]
        os.execv(sys.executable, words)
    os.close(pipes["stdout"])
    os.close(pipes["stderr"])
    os.close(full)
    sys.stdout = sys.__stdout__ = _stream(1, "strict", attempt)  # type: ignore[misc]
    sys.stderr = sys.__stderr__ = _stream(2, "backslashreplace", attempt)  # type: ignore[misc]
    sys.path[:0] = map(str, attempt.plugins)

    def report(**entries: Any) -> None:
        os.write(pipes["report"], json.dumps(entries).encode() + b"\n")

    if attempt.fault is not None:
        attempt.fault.install(box.root, lambda event: report(fired=event))
    code = _called(attempt, report) if attempt.call is not None else _commanded(attempt.words)
    os._exit(_flushed(code))


def _stream(number: int, errors: str, attempt: Attempt) -> Any:
    """Return a standard stream as the interpreter creates it at startup."""
    if attempt.wires == f"{('stdout', 'stderr')[number - 1]}-closed":
        return None
    return open(
        number,
        "w",
        encoding="utf-8",
        errors=errors,
        closefd=False,
        buffering=1 if number == 2 else -1,
    )


def _commanded(words: list[str]) -> int:
    """Run ``main`` and handle its exceptions like the interpreter."""
    from tactile_core.cli import main

    try:
        main(list(words))
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return end.code or 0
        with suppress(OSError, ValueError):
            print(end.code, file=sys.stderr)
        return 1
    except BaseException as error:
        with suppress(OSError, ValueError):
            traceback.print_exc()
        return 130 if isinstance(error, KeyboardInterrupt) else 1
    return 0


def _called(attempt: Attempt, report: Any) -> int:
    from tactile_core.errors import TactileError

    assert attempt.call is not None
    try:
        attempt.call()
    except BaseException as error:
        kind = type(error)
        kinds = [one.__name__ for one in kind.__mro__]
        name = "TactileError" if issubclass(kind, TactileError) else kind.__name__
        report(raised=[name, str(error)[:2000], place_of(error), kinds])
        return 2
    return 0


def place_of(error: BaseException) -> str:
    """Return the innermost line of this project in the traceback of an error."""
    ours = [one for one in traceback.extract_tb(error.__traceback__) if _OURS in one.filename]
    if not ours:
        return "?"
    last = ours[-1]
    return f"{last.filename.rpartition(_OURS)[2]}:{last.name}"


def _flushed(code: int) -> int:
    """Flush the streams like the interpreter at exit, and return the exit status."""
    try:
        if sys.stdout is not None and not sys.stdout.closed:
            sys.stdout.flush()
    except OSError as error:
        with suppress(OSError, ValueError):
            print(f"Exception ignored in {sys.stdout!r}: {error}", file=sys.stderr)
        code = 120
    try:
        if sys.stderr is not None and not sys.stderr.closed:
            sys.stderr.flush()
    except OSError:
        return code or 1
    return code
