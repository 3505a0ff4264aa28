"""``cluster.dask``: the workers of a dask scheduler."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from itertools import islice
from typing import Any
from uuid import uuid4

import distributed

from tactile_core.errors import InputError, TactileError
from tactile_core.interfaces.cluster import Cluster, Done, Job

_PATIENCE_S = 10  # Longest wait for the scheduler, and for its first worker


class ClusterError(TactileError):
    """The cluster does not answer, has no workers, or cannot run tactile."""

    exit_code = 1


class DaskCluster(Cluster):
    """Each thread of a worker has one job; one whose worker is killed is given to another."""

    def run(
        self, function: Callable[[Job], Done], jobs: Sequence[Job], address: str
    ) -> Generator[tuple[Job, Done | Exception], None, None]:
        """Call a function with each job, and yield the results as they come."""
        client = _connect_client(address)
        try:
            _check_workers(client, address)
            waiting = iter(jobs)
            running = distributed.as_completed(loop=client.loop)
            given: dict[Any, Job] = {}

            def give(most: int) -> None:
                # one for each thread: the scheduler shares out a few long jobs unevenly
                for job in islice(waiting, max(0, most)):
                    key = f"{function.__name__}-{uuid4().hex}"
                    future = client.submit(function, job, key=key, pure=False)
                    given[future] = job
                    running.add(future)

            give(_threads(client))
            for future in running:
                job = given.pop(future)
                found: Done | Exception = _result(future)
                give(_threads(client) - len(given))
                yield job, found
        finally:
            client.close()  # forgets what is not begun; what is under way is finished


def _threads(client: Any) -> int:
    """Return the number of jobs that can be done at once; at least one."""
    return max(1, sum(int(threads) for threads in client.nthreads().values()))


def _connect_client(address: str) -> Any:
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


def _result(future: Any) -> Any:
    """Return what a worker returned, or why none did."""
    try:
        return future.result()
    except distributed.KilledWorker:
        return ClusterError(
            "each worker of the cluster that measured it ended, perhaps because memory ran out"
        )
    except ImportError as error:
        return ClusterError(f"a worker of the cluster lacks a package ({error}); install it")
    except Exception as error:
        return error
