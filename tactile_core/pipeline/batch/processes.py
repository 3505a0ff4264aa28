"""Measures recordings in processes, each of which may be killed without losing a recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from functools import partial
from queue import SimpleQueue
from time import monotonic

from tactile_core.pipeline.batch.recording_job import (
    MeasuredRecording,
    RecordingJob,
    failed,
    measuring,
)
from tactile_core.pipeline.worker_process import WorkerProcess
from tactile_core.pipeline.workers import Workers

_ATTEMPTS = 2  # How often a recording is begun whose process is killed

_REPORT_EVERY_S = 0.2  # Time between two reports of a process

# A job, and the measured share of its recording or, last, what came of it.
Step = tuple[RecordingJob, float | MeasuredRecording]


def in_processes(jobs: Sequence[RecordingJob], workers: int) -> Iterator[Step]:
    """Measure recordings in parallel, and yield progress and results as they come.

    A recording whose process is killed is measured again by a new one; the second time it fails.

    Parameters
    ----------
    jobs : sequence of RecordingJob
    workers : int
        Number of processes.
    """
    steps = SimpleQueue[tuple[RecordingJob, float | MeasuredRecording | Exception]]()
    begun = Counter[str]()

    def measured(job: RecordingJob, worker: WorkerProcess) -> None:
        try:
            step = worker.ask(job)
            while not isinstance(step, MeasuredRecording):
                steps.put((job, step))
                step = worker.ask(None)
        except Exception as error:
            steps.put((job, error))
            raise
        steps.put((job, step))

    with Workers(min(workers, len(jobs)), _measuring) as crew:

        def give(job: RecordingJob) -> None:
            begun[job.name] += 1
            crew.submit(partial(measured, job))

        for job in jobs:
            give(job)
        left = len(jobs)
        while left:
            job, step = steps.get()
            if isinstance(step, ChildProcessError) and begun[job.name] < _ATTEMPTS:
                give(job)
                continue
            if isinstance(step, Exception):
                step = failed(job, _twice(step) if isinstance(step, ChildProcessError) else step)
            left -= isinstance(step, MeasuredRecording)
            yield job, step


def _twice(error: ChildProcessError) -> str:
    return f"each time, {error}; measure it alone or use fewer workers"


def _measuring() -> Generator[float | MeasuredRecording | None, RecordingJob, None]:
    """Measure the recordings that come, and report some of the progress."""
    job = yield None
    while True:
        said_s = monotonic()
        with closing(measuring(job)) as steps:
            for step in steps:
                if isinstance(step, MeasuredRecording):
                    job = yield step
                elif monotonic() - said_s > _REPORT_EVERY_S:
                    said_s = monotonic()
                    yield step
