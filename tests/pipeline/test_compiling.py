"""Kernels are compiled in another process, which leaves with this one and delays nothing."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from tactile_core import Pipeline
from tactile_core.pipeline import compiling

pytest.importorskip("numba")

LONGEST_S = 60.0
"""Limit of a wait for a process; usually it takes a second."""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of compiled code."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("TACTILE_FAST", raising=False)
    monkeypatch.setattr(compiling, "_begun", {})
    return tmp_path


def written(path: Path, seconds: float = 0.0) -> None:
    """Stand for compiling: wait, then leave a file."""
    time.sleep(seconds)
    with path.open("a") as file:
        file.write("done\n")


def finished(cache: Path) -> None:
    """Wait until the process is done."""
    (process,) = compiling._begun.values()
    process.wait(LONGEST_S)
    assert process.returncode == 0
    assert not list(cache.glob("tmp*")), "the task stays behind"


def test_the_task_runs_once_in_another_process_and_later_work_uses_kernels(cache: Path) -> None:
    task = partial(written, cache / "done")
    assert not compiling.already_compiled("one", task)
    assert not compiling.already_compiled("one", task)
    finished(cache)
    assert compiling.already_compiled("one", task)
    assert (cache / "done").read_text() == "done\n"


def test_each_kind_of_work_is_compiled_for_itself(cache: Path) -> None:
    compiling.already_compiled("one", partial(written, cache / "done"))
    finished(cache)
    assert not compiling.already_compiled("other", partial(written, cache / "other"))


def test_a_record_of_files_that_were_deleted_is_void(cache: Path) -> None:
    task = partial(written, cache / "done")
    compiling.already_compiled("one", task)
    finished(cache)
    (record,) = cache.glob("tactile-*.txt")
    record.write_text(str(cache / "deleted.nbi"))
    assert not compiling.already_compiled("one", task)


def test_a_task_that_fails_is_not_tried_with_every_stream(cache: Path) -> None:
    compiling.already_compiled("one", partial(written, cache / "missing" / "done"))
    (process,) = compiling._begun.values()
    assert process.wait(LONGEST_S) != 0
    assert compiling.already_compiled("one", partial(written, cache / "done"))


def test_a_task_that_cannot_be_sent_leaves_numpy(cache: Path) -> None:
    assert not compiling.already_compiled("one", lambda: None)
    assert not compiling._begun


@pytest.mark.parametrize("switch", ["0", "1"])
def test_the_environment_decides_at_once(
    cache: Path, monkeypatch: pytest.MonkeyPatch, switch: str
) -> None:
    monkeypatch.setenv("TACTILE_FAST", switch)
    chosen = compiling.already_compiled("one", partial(written, cache / "done"))
    assert chosen == (switch == "1")
    assert not compiling._begun


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="root writes everywhere")
def test_a_folder_that_is_not_writable_leaves_numpy(cache: Path) -> None:
    cache.chmod(0o500)
    assert not compiling.already_compiled("one", partial(written, cache / "done"))
    assert not compiling._begun


def test_a_folder_that_cannot_be_made_leaves_numpy(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (cache / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(cache / "file" / "folder"))
    assert not compiling.already_compiled("one", partial(written, cache / "done"))
    assert not compiling._begun


def test_two_processes_compile_one_after_the_other(cache: Path) -> None:
    order = cache / "order"
    compiling.already_compiled("one", partial(written, order, 0.3))
    (first,) = compiling._begun.values()
    compiling._begun.clear()  # as in another process
    compiling.already_compiled("other", partial(written, order))
    (second,) = compiling._begun.values()
    assert [process.wait(LONGEST_S) for process in (first, second)] == [0, 0]
    assert order.read_text() == "done\n" * 2
    assert len(list(cache.glob("tactile-*.txt"))) == 2


LEAVES = """\
import os, sys, time
from functools import partial
from pathlib import Path
from tactile_core.pipeline import compiling
compiling.already_compiled("one", partial(time.sleep, 600))
(process,) = compiling._begun.values()
while any(Path(os.environ["NUMBA_CACHE_DIR"]).glob("tmp*")):
    time.sleep(0.01)
print(process.pid, flush=True)
if sys.argv[1] == "abruptly":
    os._exit(0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signal 0 is one of Unix")
@pytest.mark.parametrize("how", ["normally", "abruptly"])
def test_the_process_leaves_with_its_parent(cache: Path, how: str) -> None:
    began = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", LEAVES, how],
        capture_output=True,
        text=True,
        check=True,
        timeout=LONGEST_S,
    )
    assert not done.stderr
    while _runs(int(done.stdout)):
        assert time.monotonic() - began < LONGEST_S
        time.sleep(0.01)


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{pid}/stat")  # nobody may wait for an orphan in a container
    return not (status.exists() and status.read_text().rpartition(")")[2].split()[0] == "Z")


def test_a_first_pipeline_measures_with_numpy(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[str] = []
    monkeypatch.setattr(compiling, "_begin", lambda record, task: begun.append(record.name))
    kinds = [Pipeline(name) for name in ("hex_fingertip", "hex_fingertip", "desktop_six_led")]
    assert not any(one.compiled for one in kinds)
    assert len(set(begun)) == 2
    assert Pipeline("hex_fingertip", compiled=True).compiled
