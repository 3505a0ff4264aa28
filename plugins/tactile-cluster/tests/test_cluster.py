"""A local cluster of two worker processes gives the same, even if one of them is killed."""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import distributed
import pytest
from support.many_recordings import many_recordings
from support.virtual_lab import VirtualLab

from tactile_cluster.dask_cluster import ClusterError
from tactile_core.errors import InputError
from tactile_core.pipeline.batch.batch import Batch
from tactile_core.pipeline.batch.recording_job import MeasuredRecording

NAMES = ("lift_1", "lift_2", "lift_3")


@pytest.fixture
def address() -> Iterator[str]:
    """Address of the scheduler of a cluster of two processes with one thread each."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        yield cluster.scheduler_address


def batch(lab: VirtualLab, inputs: Path, out: Path | None) -> Batch:
    return Batch(lab.profile, [inputs], out=out, bundle=lab.bundle, save=["tmd"] if out else [])


def steady(found: list[MeasuredRecording]) -> list[list[dict[str, object]]]:
    return [[{**line, "latency_ms": None} for line in one.lines()] for one in found]


def kill_a_worker(out: Path, killed: list[str]) -> None:
    """Kill the first process that has begun to write results."""
    while not killed:
        time.sleep(0.01)
        for folder in out.glob(".lift_*.new") if out.is_dir() else ():
            worker = re.search(r"-(\d+)-[0-9a-f]{8}\.new$", folder.name)
            if worker and any(folder.glob("*.tmd")):
                os.kill(int(worker[1]), signal.SIGKILL)
                killed.append(folder.name)


@pytest.mark.soak
@pytest.mark.filterwarnings("default")
def test_a_killed_worker_of_a_cluster_loses_nothing(
    lab: VirtualLab, tmp_path: Path, address: str
) -> None:
    inputs = many_recordings(lab, tmp_path / "recordings", NAMES, frames=60)
    alone = list(batch(lab, inputs, None).measure())
    killed: list[str] = []
    murder = threading.Thread(target=kill_a_worker, args=(tmp_path / "out", killed), daemon=True)
    murder.start()
    found = list(batch(lab, inputs, tmp_path / "out").measure(cluster=address))
    assert killed
    assert [one.failure for one in found] == ["", "", ""]
    assert steady(found) == steady(alone)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == list(NAMES)
    again = list(batch(lab, inputs, tmp_path / "out").measure(cluster=address))
    assert all(one.earlier for one in again)


def test_a_cluster_that_does_not_answer_is_one_sentence(
    lab: VirtualLab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactile_cluster.dask_cluster._PATIENCE_S", 0.2)
    inputs = many_recordings(lab, tmp_path / "recordings", frames=1)
    with pytest.raises(ClusterError, match=r"no dask scheduler answers at tcp://127\.0\.0\.1:1"):
        list(batch(lab, inputs, None).measure(cluster="tcp://127.0.0.1:1"))
    for nonsense in ("nonsense", "http://", ""):
        with pytest.raises((InputError, ClusterError)) as caught:
            list(batch(lab, inputs, None).measure(cluster=nonsense))
        assert "\n" not in str(caught.value)
