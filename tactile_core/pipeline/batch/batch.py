"""Measures many recordings, here or on a cluster."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.files import remove_leftovers
from tactile_core.formats.folders import make_folder
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.pipeline.batch.plan import Step, check_folders, in_processes, plan_jobs
from tactile_core.pipeline.batch.recording_job import (
    MeasuredRecording,
    RecordingJob,
    measure_recording,
    measured_earlier,
    measuring,
    report_failure,
)
from tactile_core.plugins.blame import blame
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.model import Profile

CLUSTER = "cluster.dask"  # The cluster of this project, in a distribution of its own


def on_cluster(
    jobs: Sequence[RecordingJob], address: str
) -> Iterator[tuple[RecordingJob, MeasuredRecording]]:
    """Measure recordings by the workers of a scheduler, and yield results as they come.

    The workers need the same packages, and the same paths for recordings, bundle and results. A
    recording whose worker is killed is measured again by another, as often as the scheduler allows.

    Parameters
    ----------
    jobs : sequence of RecordingJob
        Their paths are absolute.
    address : str
        Of the scheduler, such as ``tcp://10.0.0.5:8786``.

    Raises
    ------
    InputError
        This is no address.
    PluginError
        The distribution of the cluster is not installed.
    TactileError
        The scheduler does not answer, or has no workers.
    """
    kind = resolve("cluster", CLUSTER)
    with closing(kind().run(measured_in_one_thread, jobs, address)) as running:
        while True:
            with blame("the cluster", kind):  # not around the yield: a caller's error is not its
                found = next(running, None)
            if found is None:
                return
            job, result = found
            yield job, report_failure(job, result) if isinstance(result, Exception) else result


def measured_in_one_thread(job: RecordingJob) -> MeasuredRecording:
    """Measure a recording in a worker, whose number of threads the cluster has chosen.

    By itself OpenCV would use every core, and the workers of a machine would hinder each other.
    """
    import cv2

    cv2.setNumThreads(1)
    return measure_recording(job)


class Batch:
    """Recordings that are measured alike, each with results of its own.

    Each recording is measured as :func:`~tactile_core.pipeline.opening.open_sensor` measures it
    alone, whatever the number of processes. One that an earlier run has measured completely, with
    the same profile, calibration and options, is not measured again.

    Parameters
    ----------
    profile : Profile, str or Path
        A profile, its name, or the path of its YAML file.
    inputs : sequence of Path
        Recordings, and folders of recordings; see
        :func:`~tactile_core.recordings.recovery.list_recordings`.
    out : Path, optional
        Folder in which each recording has its results in a folder of its name. They appear there
        when they are complete.
    save : sequence of str
        Names of the sinks; see :class:`~tactile_core.pipeline.sinks.Sinks`.
    bundle, reference, serial, gel
        As of :func:`~tactile_core.pipeline.opening.open_sensor`.
    tare_frame, frames : int, optional
        Number of the frame of each recording whose load is subtracted; most frames of each.

    Attributes
    ----------
    jobs : tuple of RecordingJob
        One for each recording, in order.

    Raises
    ------
    ProfileError, PluginError, CalibrationError, InputError
        An argument is unusable, or results would replace files that no command wrote.
    """

    def __init__(
        self,
        profile: Profile | str | Path,
        inputs: Sequence[Path],
        *,
        out: Path | None = None,
        save: Sequence[str] = (),
        bundle: Path | None = None,
        reference: Path | str | None = None,
        serial: str | None = None,
        gel: str | None = None,
        tare_frame: int | None = None,
        frames: int | None = None,
    ) -> None:
        self._out = out
        self.jobs = plan_jobs(
            profile,
            inputs,
            out=out,
            save=save,
            bundle=bundle,
            reference=reference,
            serial=serial,
            gel=gel,
            tare_frame=tare_frame,
            frames=frames,
        )
        earlier = [measured_earlier(job) for job in self.jobs]
        self._earlier = {found.name: found for found in earlier if found is not None}
        check_folders([job for job in self.jobs if job.name not in self._earlier])

    def measure(
        self, *, workers: int = 1, cluster: str | None = None, progress: Progress | None = None
    ) -> Generator[MeasuredRecording, None, None]:
        """Measure the recordings and yield what came of each, in order.

        Closing the generator ends the processes.

        Parameters
        ----------
        workers : int
            Number of processes; 1 measures in this process.
        cluster : str, optional
            Address of a dask scheduler, whose workers measure instead. They need the same
            packages, and the same paths for recordings, bundle and results.
        progress : Progress, optional

        Raises
        ------
        InputError
            Several processes and a cluster are asked for, or this is no address of one.
        PluginError
            The distribution of the cluster is not installed.
        TactileError
            The cluster does not answer, or has no workers.
        """
        if cluster is not None and workers > 1:
            raise InputError(
                "a cluster decides itself how many processes measure; give either workers or a "
                "cluster"
            )
        progress = Silent() if progress is None else progress
        done = dict(self._earlier)
        jobs = [job for job in self.jobs if job.name not in done]
        left, shares = deque(self.jobs), dict.fromkeys((job.name for job in jobs), 0.0)

        def show(job: RecordingJob, share: float) -> None:
            shares[job.name] = share
            progress.fraction(sum(shares.values()) / len(shares))

        progress.stage(f"measuring {len(jobs)} recordings", 1.0)
        if self._out is not None:
            make_folder(self._out)
        try:
            yield from _ready(left, done)
            with closing(_steps(jobs, workers, cluster)) as steps:
                for job, step in steps:
                    if isinstance(step, MeasuredRecording):
                        done[job.name], step = step, 1.0
                    show(job, step)
                    yield from _ready(left, done)
        finally:
            if self._out is not None:
                remove_leftovers(self._out)  # of processes that were killed


def _steps(
    jobs: Sequence[RecordingJob], workers: int, cluster: str | None
) -> Generator[Step, None, None]:
    if not jobs:
        return
    if cluster is not None:
        yield from on_cluster(jobs, cluster)
    elif workers > 1:
        yield from in_processes(jobs, workers)
    else:
        yield from ((job, step) for job in jobs for step in measuring(job))


def _ready(
    left: deque[RecordingJob], done: dict[str, MeasuredRecording]
) -> Iterator[MeasuredRecording]:
    """Yield what came of the next recordings, as far as it is known, and forget it."""
    while left and left[0].name in done:
        yield done.pop(left.popleft().name)
