"""What a batch measures, and the processes that share it."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from time import monotonic
from typing import Any

from tactile_core import __version__
from tactile_core.acquisition.devices import images_per_observation
from tactile_core.bundles.bundle import Bundle
from tactile_core.bundles.places import default_place
from tactile_core.errors import InputError
from tactile_core.formats.scan import SCAN_FILE
from tactile_core.pipeline.batch.recording_job import (
    MeasuredRecording,
    RecordingJob,
    measuring,
    report_failure,
)
from tactile_core.pipeline.initial_reference import reference_path
from tactile_core.pipeline.sinks import Sinks
from tactile_core.pipeline.workers import WorkerProcess, Workers
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.recordings.inputs import Inputs
from tactile_core.recordings.output_folder import OutputFolder, own_files
from tactile_core.recordings.recovery import list_recordings
from tactile_core.recordings.source import is_recorded


def plan_jobs(
    profile: Profile | str | Path,
    inputs: Sequence[Path],
    *,
    out: Path | None,
    save: Sequence[str],
    bundle: Path | None,
    reference: Path | str | None,
    serial: str | None,
    gel: str | None,
    tare_frame: int | None,
    frames: int | None,
) -> tuple[RecordingJob, ...]:
    """Return the job of each recording, after checking what holds for all of them.

    The arguments are those of :class:`~tactile_core.pipeline.batch.batch.Batch`.
    """
    known = profile if isinstance(profile, Profile) else load_profile(profile)
    count = images_per_observation(known)
    recordings = list_recordings(inputs, images_per_observation=count)
    # what a sensor recorded has its own bundle
    place = default_place(known, serial, gel) if bundle is None else bundle
    default = place.absolute() if bundle is not None or place.is_dir() else None
    loaded = None if default is None else Bundle.load(default)
    if Sinks(known, save).endings and out is None:
        raise InputError(f"{', '.join(save)} writes files; name a folder for them")
    if out is not None:
        _check_out(out, inputs, default, reference)
    path = reference_path(reference)
    reference = reference if path is None else path.absolute()
    if not isinstance(profile, Profile) and Path(profile).suffix in (".yaml", ".yml"):
        profile = Path(profile).absolute()
    common: dict[str, Any] = {
        "reference": reference,
        "serial": serial,
        "gel": gel,
        "save": tuple(dict.fromkeys(save)),
        "tare_frame": tare_frame,
        "frames": frames,
    }
    basis = {
        **common,
        "reference": _content(reference) if isinstance(reference, Path) else reference,
        "profile": known.model_dump(mode="json"),
        "bundle": None if loaded is None else loaded.manifest.content_hash,
        "version": __version__,
    }
    return tuple(
        RecordingJob(
            name=one.name,
            recording=one.path.absolute(),
            folder=None if out is None else out.absolute() / one.name,
            fingerprint=_hash({**basis, "recording": [one.name, _content(one.path)]}),
            profile=profile,
            bundle=None if bundle is None and is_recorded(one.path) else default,
            **common,
        )
        for one in recordings
    )


def check_folders(jobs: Sequence[RecordingJob]) -> None:
    """Refuse results that would replace an input or a file that no command wrote.

    Raises
    ------
    InputError
    """
    recordings = {job.recording.resolve() for job in jobs}
    for folder in (job.folder for job in jobs if job.folder is not None):
        if folder.resolve() in recordings:
            raise InputError(f"{folder} is a recording itself; name another --out folder")
        if folder.exists() or folder.is_symlink():
            own_files(folder)


def _check_out(
    out: Path, inputs: Sequence[Path], bundle: Path | None, reference: Path | str | None
) -> None:
    shared: dict[str, Path | str | None] = {
        "--bundle": bundle,
        "--reference": reference_path(reference),
    }
    OutputFolder(out, Inputs.from_paths(shared))
    for path in inputs:
        OutputFolder(out, Inputs.from_paths({"--input": path}))


def _content(path: Path) -> list[tuple[str, int, int]]:
    """Return name, size and time of modification of a file, or of all files in a folder."""
    if path.name == SCAN_FILE:
        path = path.parent
    if not path.is_dir():
        found = path.stat()
        return [(path.name, found.st_size, found.st_mtime_ns)]
    files = [(file, file.stat()) for file in sorted(path.rglob("*")) if file.is_file()]
    return [(str(f.relative_to(path)), found.st_size, found.st_mtime_ns) for f, found in files]


def _hash(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


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
            # [count] a recording whose process is killed is begun again
            if isinstance(step, ChildProcessError) and begun[job.name] < 2:
                give(job)
                continue
            if isinstance(step, Exception):
                step = report_failure(
                    job, _twice(step) if isinstance(step, ChildProcessError) else step
                )
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
                elif monotonic() - said_s > 0.2:  # [s] between two reports
                    said_s = monotonic()
                    yield step
