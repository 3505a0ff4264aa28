"""Many recordings give what each gives alone; nothing is lost, and nothing is measured twice."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import pytest
from support.many_recordings import many_recordings
from support.own_plugins import Install
from support.virtual_lab import VirtualLab

from tactile_core.errors import InputError, PluginError, PluginFault
from tactile_core.formats.npz import read_npz
from tactile_core.pipeline.batch import batch as batch_module
from tactile_core.pipeline.batch import plan
from tactile_core.pipeline.batch.batch import Batch, measured_in_one_thread
from tactile_core.pipeline.batch.recording_job import MeasuredRecording
from tactile_core.pipeline.opening import open_sensor
from tactile_core.quantities import HeightMap

NAMES = ("lift_1", "lift_2", "lift_3")


@pytest.fixture
def inputs(lab: VirtualLab, tmp_path: Path) -> Path:
    return many_recordings(lab, tmp_path / "recordings", NAMES)


def batch(lab: VirtualLab, inputs: Path, **options: Any) -> Batch:
    out = inputs.with_name("results")
    options = {"out": out, "save": ["npz"], "bundle": lab.bundle} | options
    return Batch(lab.profile, [inputs], **options)


def steady(found: MeasuredRecording) -> list[dict[str, Any]]:
    """Return the lines without the time that each reading took."""
    return [{**line, "latency_ms": None} for line in found.lines()]


def test_each_recording_gives_what_it_gives_alone(lab: VirtualLab, inputs: Path) -> None:
    results = list(batch(lab, inputs).measure())
    assert [found.name for found in results] == list(NAMES)
    with open_sensor(lab.profile, bundle=lab.bundle, input=inputs / "lift_2") as sensor:
        alone = list(sensor.stream())
    folder = results[1].folder
    assert folder == inputs.with_name("results") / "lift_2"
    for reading in alone:
        saved = read_npz(folder / f"{reading.source}.npz")
        assert saved["height_mm"].tobytes() == reading[HeightMap].mm.tobytes()
    lines = steady(results[1])
    expected = [{"recording": "lift_2", **one.summary(), "latency_ms": None} for one in alone]
    assert lines == expected
    assert results[1].deepest_mm == max(line["max_height_mm"] for line in expected)


def test_what_is_complete_is_not_measured_again(lab: VirtualLab, inputs: Path) -> None:
    first = list(batch(lab, inputs).measure())
    times = {path: path.stat().st_mtime_ns for path in inputs.with_name("results").rglob("*.*")}
    many_recordings(lab, inputs, ("lift_0",))
    second = list(batch(lab, inputs).measure())
    assert [found.earlier for found in second] == [False, True, True, True]
    assert [list(found.lines()) for found in second[1:]] == [list(one.lines()) for one in first]
    assert all(path.stat().st_mtime_ns == time_ns for path, time_ns in times.items())


def test_other_options_and_changed_recordings_are_measured_again(
    lab: VirtualLab, inputs: Path
) -> None:
    list(batch(lab, inputs).measure())
    assert [found.earlier for found in batch(lab, inputs, frames=2).measure()] == [False] * 3
    os.utime(inputs / "lift_2" / "f000.png", ns=(0, 0))
    os.link(inputs / "lift_3" / "f000.png", inputs / "lift_3" / "f003.png")
    found = list(batch(lab, inputs, frames=2).measure())
    assert [one.earlier for one in found] == [True, False, False]
    assert [one.observations for one in found] == [2, 2, 2]


def test_a_broken_recording_is_left_out_and_the_others_are_measured(
    lab: VirtualLab, inputs: Path
) -> None:
    (inputs / "lift_2" / "f001.png").unlink()
    (inputs / "lift_2" / "f001.png").write_bytes(
        (inputs / "lift_1" / "f000.png").read_bytes()[:999]
    )
    found = list(batch(lab, inputs).measure())
    assert "f001.png" in found[1].failure
    assert [one.observations for one in found] == [3, 0, 3]
    folder = inputs.with_name("results")
    assert sorted(path.name for path in folder.iterdir()) == ["lift_1", "lift_3"]


def test_results_never_replace_files_of_the_user(lab: VirtualLab, inputs: Path) -> None:
    mine = inputs.with_name("results") / "lift_2" / "notes.txt"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    with pytest.raises(InputError, match=r"notes.txt is not as tactile wrote it"):
        batch(lab, inputs)
    with pytest.raises(InputError, match="--input"):
        batch(lab, inputs, out=inputs)
    assert mine.read_text() == "mine"


class Watched:
    """A progress that remembers."""

    def __init__(self) -> None:
        self.stages: list[str] = []
        self.shares: list[float] = []

    def stage(self, words: str, share: float) -> None:
        self.stages.append(words)

    def fraction(self, done: float) -> None:
        self.shares.append(done)


def test_one_progress_covers_all_recordings(lab: VirtualLab, inputs: Path) -> None:
    watched = Watched()
    list(batch(lab, inputs).measure(progress=watched))
    assert watched.stages == ["measuring 3 recordings"]
    assert watched.shares == sorted(watched.shares)
    assert watched.shares[0] == pytest.approx(1 / 9)
    assert watched.shares[-1] == 1


def working() -> list[int]:
    """Return the numbers of the worker processes of this one."""
    children = Path(f"/proc/{os.getpid()}/task").glob("*/children")
    numbers = [int(number) for path in children for number in path.read_text().split()]
    return [n for n in numbers if "pipeline.workers" in Path(f"/proc/{n}/cmdline").read_text()]


def kill_one() -> None:
    """Kill a process that measures, as the operating system does if memory runs out."""
    os.kill(working()[0], signal.SIGKILL)


def test_a_killed_process_loses_nothing(
    lab: VirtualLab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inputs = many_recordings(lab, tmp_path / "long", NAMES[:2], frames=60)
    alone = list(batch(lab, inputs, out=None, save=()).measure())
    steps, killed = plan.in_processes, []

    def with_a_murder(jobs: Any, workers: int) -> Iterator[plan.Step]:
        for job, step in steps(jobs, workers):
            if not killed:
                assert isinstance(step, float), "a recording was complete too early"
                kill_one()
                killed.append(job)
            yield job, step

    monkeypatch.setattr("tactile_core.pipeline.batch.batch.in_processes", with_a_murder)
    found = list(batch(lab, inputs).measure(workers=2))
    assert killed
    assert [steady(one) for one in found] == [steady(one) for one in alone]
    assert sorted(path.name for path in (tmp_path / "results").iterdir()) == list(NAMES[:2])


@pytest.mark.soak
def test_a_recording_whose_process_is_killed_twice_is_left_out(
    lab: VirtualLab, tmp_path: Path
) -> None:
    inputs = many_recordings(lab, tmp_path / "long", NAMES[:1], frames=200)
    jobs = batch(lab, inputs, out=None, save=()).jobs
    results = []
    for _, step in plan.in_processes(jobs, 1):
        if isinstance(step, MeasuredRecording):
            results.append(step)
        else:
            kill_one()
    assert "each time, a worker process ended" in results[0].failure


def test_no_process_survives_a_batch_that_is_abandoned(lab: VirtualLab, tmp_path: Path) -> None:
    inputs = many_recordings(lab, tmp_path / "long", NAMES[:1], frames=200)
    steps = plan.in_processes(batch(lab, inputs).jobs, 1)
    next(steps)
    steps.close()  # type: ignore[attr-defined]
    assert not working()
    assert not (tmp_path / "results").exists()


def test_what_sensors_recorded_is_measured_with_its_own_bundle(
    lab: VirtualLab, inputs: Path
) -> None:
    pytest.importorskip("mcap", reason="the extra 'record' is not installed")
    recorded = inputs.with_name("recorded")
    recorded.mkdir()
    for name, ending in (("lift_1", ".mcap"), ("lift_2", "")):
        path = recorded / f"{name}{ending}"
        with (
            open_sensor(lab.profile_path, bundle=lab.bundle, input=inputs / name) as sensor,
            sensor.record(path),
        ):
            list(sensor.stream())
    jobs = Batch(lab.profile_path, [recorded])
    found = list(jobs.measure())
    with open_sensor(lab.profile_path, input=recorded / "lift_1.mcap") as sensor:
        alone = list(sensor.stream())
    assert [(one.name, one.failure) for one in found] == [("lift_1", ""), ("lift_2", "")]
    expected = [{"recording": "lift_1", **one.summary(), "latency_ms": None} for one in alone]
    assert steady(found[0]) == expected
    assert found[1].deepest_mm


OWN_CLUSTER = """
from tactile_core.errors import TactileError
from tactile_core.interfaces.cluster import Cluster

class Here(Cluster):
    def run(self, function, jobs, address):
        for job in reversed(jobs):
            if address == "broken":
                raise RuntimeError("no")
            yield job, TactileError("its worker ended") if job.name == "lift_2" else function(job)
"""


def test_a_plugin_s_cluster_measures_and_says_what_it_could_not(
    lab: VirtualLab, inputs: Path, install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    install("lab", {"here.py": OWN_CLUSTER}, tactile_clusters={"here": "own_lab.here:Here"})
    monkeypatch.setattr(batch_module, "CLUSTER", "lab.here")
    with pytest.raises(PluginFault, match=r"the cluster .*tactile-lab"):
        list(batch(lab, inputs).measure(cluster="broken"))
    found = list(batch(lab, inputs).measure(cluster="here"))
    assert [one.name for one in found] == list(NAMES)
    assert [one.failure for one in found] == ["", "its worker ended", ""]
    assert found[0].observations == 3


def test_a_cluster_whose_distribution_is_absent_is_named_with_its_pip_command(
    lab: VirtualLab, inputs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch_module, "CLUSTER", "elsewhere.dask")
    with pytest.raises(PluginError, match=r"'elsewhere\.dask' .*pip install tactile-elsewhere"):
        list(batch(lab, inputs).measure(cluster="tcp://127.0.0.1:1"))


def test_a_worker_measures_in_one_thread_as_the_cluster_expects(
    lab: VirtualLab, inputs: Path
) -> None:
    (job, *_) = batch(lab, inputs).jobs
    before = cv2.getNumThreads()
    cv2.setNumThreads(2)
    try:
        found = measured_in_one_thread(job)
        assert (found.failure, found.observations) == ("", 3)
        assert cv2.getNumThreads() == 1
    finally:
        cv2.setNumThreads(before)
