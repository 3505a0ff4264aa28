"""Measures recordings in processes, each of which may be killed without losing a recording."""

from __future__ import annotations

import signal
import sys
import warnings
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from time import monotonic

from tactile_core.pipeline.batch.recording_job import (
    MeasuredRecording,
    RecordingJob,
    failed,
    measured,
)

_ATTEMPTS = 2
"""How often a recording is begun whose process is killed."""

_REPORT_EVERY_S = 0.2
"""Time between two reports of a process."""

_PATIENCE_S = 5.0
"""Time in which a process that is no longer needed should end."""

Step = tuple[RecordingJob, float | MeasuredRecording]
"""A job, and the measured share of its recording or, last, what came of it."""


@dataclass
class _Worker:
    """A process, and the recording that it measures."""

    process: BaseProcess
    connection: Connection
    job: RecordingJob | None = None


def in_processes(jobs: Sequence[RecordingJob], workers: int) -> Iterator[Step]:
    """Measure recordings in parallel, and yield progress and results as they come.

    A recording whose process is killed is measured again by a new one; the second time it fails.

    Parameters
    ----------
    jobs : sequence of RecordingJob
    workers : int
        Number of processes.
    """
    left, begun = deque(jobs), dict[str, int]()
    crew = [_started() for _ in range(min(workers, len(jobs)))]
    try:
        for worker in crew:
            _give(worker, left, begun)
        while any(worker.job is not None for worker in crew):
            ready = wait([worker.connection for worker in crew if worker.job is not None])
            for worker in [worker for worker in crew if worker.connection in ready]:
                job = worker.job
                assert job is not None
                try:
                    answer = worker.connection.recv()
                except (EOFError, OSError):
                    crew.remove(worker)
                    _end(worker)
                    again = begun[job.name] < _ATTEMPTS
                    if again:
                        left.appendleft(job)
                    if left:
                        crew.append(_started())
                        _give(crew[-1], left, begun)
                    if not again:
                        yield job, failed(job, _killed(worker.process.exitcode))
                else:
                    if isinstance(answer, MeasuredRecording):
                        _give(worker, left, begun)
                    yield job, answer
    finally:
        for worker in crew:
            _end(worker)


def _started() -> _Worker:
    # "spawn": a forked process would inherit locks that its missing threads can never release
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs,), daemon=True)
    process.start()
    theirs.close()  # else the end of the process would not be noticed
    return _Worker(process, ours)


def _give(worker: _Worker, left: deque[RecordingJob], begun: dict[str, int]) -> None:
    worker.job = left.popleft() if left else None
    if worker.job is not None:
        begun[worker.job.name] = begun.get(worker.job.name, 0) + 1
        with suppress(OSError):  # a process that has just ended is noticed when it should answer
            worker.connection.send(worker.job)


def _end(worker: _Worker) -> None:
    worker.connection.close()
    if worker.job is not None:
        worker.process.terminate()
    worker.process.join(_PATIENCE_S)
    if worker.process.is_alive():
        worker.process.kill()
        worker.process.join()


def _killed(code: int | None) -> str:
    return (
        f"the process that measured it ended twice (exit code {code}), perhaps because memory ran "
        f"out; measure it alone or use fewer workers"
    )


def _work(connection: Connection) -> None:
    """Measure the recordings that come, until the other process closes the connection."""
    import cv2

    # Ctrl-C is handled by the process that consumes the results
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # removes what is unfinished
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    cv2.setNumThreads(1)
    said_s = 0.0

    def report(share: float) -> None:
        nonlocal said_s
        if monotonic() - said_s > _REPORT_EVERY_S:
            said_s = monotonic()
            try:
                connection.send(share)
            except OSError:
                sys.exit(1)  # the other process has ended

    with suppress(EOFError, OSError):
        while True:
            connection.send(measured(connection.recv(), report))
