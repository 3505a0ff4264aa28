"""Measures recordings on a cluster, through a dask scheduler; needs the extra ``cluster``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

from tactile_core.errors import InputError, TactileError
from tactile_core.pipeline.batch.recording_job import (
    MeasuredRecording,
    RecordingJob,
    measure_recording,
    report_failure,
)

_PATIENCE_S = 10  # Longest wait for the scheduler, and for its first worker


class ClusterError(TactileError):
    """The cluster does not answer, has no workers, or cannot run tactile."""

    exit_code = 1


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
        The extra is not installed, or this is no address.
    ClusterError
        The scheduler does not answer, or has no workers.
    """
    distributed = _library()
    client = _connect_client(distributed, address)
    try:
        _check_workers(client, address)
        waiting = iter(jobs)
        running = distributed.as_completed(loop=client.loop)
        given = {}

        def give(most: int) -> None:
            # one for each thread: the scheduler shares out a few long recordings unevenly
            for job in islice(waiting, max(0, most)):
                future = client.submit(measured_in_one_thread, job, key=_key(job), pure=False)
                given[future] = job
                running.add(future)

        give(_threads(client))
        for future in running:
            job = given.pop(future)
            found = _result(future, job)
            give(_threads(client) - len(given))
            yield job, found
    finally:
        client.close()  # forgets what is not measured yet; what is under way is written


def measured_in_one_thread(job: RecordingJob) -> MeasuredRecording:
    """Measure a recording in a worker, whose number of threads the cluster has chosen.

    By itself OpenCV would use every core, and the workers of a machine would hinder each other.
    """
    import cv2

    cv2.setNumThreads(1)
    return measure_recording(job)


def _threads(client: Any) -> int:
    """Return the number of recordings that can be measured at once; at least one."""
    return max(1, sum(int(threads) for threads in client.nthreads().values()))


def _key(job: RecordingJob) -> str:
    import uuid

    return f"{job.name}-{uuid.uuid4().hex}"


def _library() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError(
            "a cluster needs dask; install it with: pip install 'tactile-core[cluster]'"
        ) from None
    return distributed


def _connect_client(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=_PATIENCE_S, set_as_default=False)
    except (ValueError, TypeError) as error:
        raise InputError(
            f"{address!r} is no address of a dask scheduler ({error}); give one such as "
            f"tcp://127.0.0.1:8786"
        ) from None
    except OSError:
        raise ClusterError(
            f"no dask scheduler answers at {address}; check the address, or start one with: "
            f"dask scheduler"
        ) from None


def _check_workers(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=_PATIENCE_S)
    except TimeoutError:
        raise ClusterError(
            f"the dask scheduler at {address} has no workers; start some with: dask worker "
            f"{address} --nthreads 1 --nworkers auto"
        ) from None


def _result(future: Any, job: RecordingJob) -> MeasuredRecording:
    try:
        found = future.result()
    except Exception as error:  # of the cluster: measured() raises none
        name = type(error).__name__
        if name == "KilledWorker":
            return report_failure(
                job,
                "each worker of the cluster that measured it ended, perhaps because memory ran out",
            )
        if isinstance(error, ImportError):
            return report_failure(
                job, f"a worker of the cluster lacks a package ({error}); install it"
            )
        return report_failure(job, error)
    assert isinstance(found, MeasuredRecording)
    return found
