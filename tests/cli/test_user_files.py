"""No command replaces or deletes files that it did not write."""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support import command_line
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.bundles.bundle import Bundle

LIMIT_BYTES = 60_000
"""Largest file on the simulated full disk, bytes."""


def tactile(
    *words: object, full_disk: bool = False, **environment: str
) -> subprocess.CompletedProcess[bytes]:
    """Run the command; for a full disk, in a separate process with a limit on file sizes."""

    if not full_disk and not environment:
        done = command_line.tactile(*words)
        return subprocess.CompletedProcess(
            done.args, done.returncode, done.stdout.encode(), done.stderr.encode()
        )

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT_BYTES, LIMIT_BYTES))

    return subprocess.run(
        [sys.executable, "-m", "tactile_core.cli", *map(os.fspath, map(_word, words))],
        capture_output=True,
        check=False,
        env=os.environ | environment,
        preexec_fn=limit if full_disk else None,
    )


def _word(word: object) -> str | Path:
    return word if isinstance(word, Path) else str(word)


def held(folder: Path) -> dict[str, bytes | None]:
    """Return everything in a folder, including empty folders and hidden files."""
    return {
        str(path.relative_to(folder)): None if path.is_dir() else path.read_bytes()
        for path in folder.rglob("*")
    }


def refused(folder: Path, *words: object) -> str:
    """Run a command that must fail with one sentence and leave the folder unchanged."""
    before = held(folder)
    done = tactile(*words)
    message = done.stderr.decode()
    assert (done.returncode, done.stdout) == (2, b""), message
    assert message.startswith("tactile: ")
    assert message.count("\n") == 1, message
    assert held(folder) == before
    return message


@pytest.fixture
def mine(lab: VirtualLab, tmp_path: Path) -> Path:
    """Create a user's folder with a recording, a reference, presses and a bundle."""
    lab.save(tmp_path / "in" / "ball.png", BallPress((70.0, 62.0), BALL_MM, 0.8))
    lab.save(tmp_path / "in" / "rest.png", None)
    lab.save(tmp_path / "ref" / "ball.png", None)
    shutil.copytree(lab.bundle, tmp_path / "b")
    return tmp_path


def run(lab: VirtualLab, mine: Path, *words: object) -> tuple[object, ...]:
    return ("run", lab.profile_path, "--bundle", mine / "b", "--input", mine / "in", *words)


def calibrate(lab: VirtualLab, *words: object) -> tuple[object, ...]:
    how = ("--ball-diameter-mm", BALL_MM, "--model", "core.polynomial")
    return ("calibrate", lab.profile_path, "--reference", lab.reference, *how, *words)


@pytest.mark.parametrize("manifest", ["{}", '{"name": "web app", "manifest_version": 3}'])
def test_calibrating_into_another_project_deletes_nothing(
    lab: VirtualLab, tmp_path: Path, manifest: str
) -> None:
    (tmp_path / "app" / "src").mkdir(parents=True)
    (tmp_path / "app" / "src" / "main.py").write_text("years of work")
    (tmp_path / "app" / "manifest.json").write_text(manifest)
    words = calibrate(lab, "--presses", lab.presses, "--out", tmp_path / "app")
    assert "not a calibration bundle" in refused(tmp_path, *words)


def test_calibrating_into_a_bundle_with_notes_names_them(lab: VirtualLab, mine: Path) -> None:
    (mine / "b" / "notes.txt").write_text("mine")
    message = refused(mine, *calibrate(lab, "--presses", lab.presses, "--out", mine / "b"))
    assert "holds notes.txt" in message
    assert "move it away" in message


@pytest.mark.parametrize("linked", [False, True])
def test_presses_inside_the_bundle_folder_are_refused(
    lab: VirtualLab, mine: Path, linked: bool
) -> None:
    presses = Path(shutil.copytree(lab.presses, mine / "b" / "presses"))
    if linked:
        (mine / "linked").symlink_to(presses)
        presses = mine / "linked"
    message = refused(mine, *calibrate(lab, "--presses", presses, "--out", mine / "b"))
    assert "contains --presses" in message


def test_results_in_a_bundle_folder_are_refused(lab: VirtualLab, mine: Path) -> None:
    (mine / "also_b").symlink_to(mine / "b")
    for out in (mine / "b", mine / "also_b"):
        assert "is --bundle" in refused(mine, *run(lab, mine, "--out", out))


def test_results_do_not_replace_the_reference(lab: VirtualLab, mine: Path) -> None:
    words = run(lab, mine, "--reference", mine / "ref" / "ball.png", "--out", mine / "ref")
    assert "contains --reference" in refused(mine, *words, "--save", "png")


def test_results_with_the_same_name_are_refused_before_measuring(
    lab: VirtualLab, mine: Path
) -> None:
    shutil.copy(mine / "in" / "rest.png", mine / "in" / "ball_normals.png")
    message = refused(mine, *run(lab, mine, "--out", mine / "out", "--save", "png"))
    assert "results of ball and of ball_normals would both be ball_normals.png" in message


def test_a_run_replaces_its_own_results_and_no_other_files(lab: VirtualLab, mine: Path) -> None:
    words = run(lab, mine, "--out", mine / "out", "--save", "npz,png")
    for _ in range(2):
        done = tactile(*words)
        assert done.returncode == 0, done.stderr
    (mine / "out" / "rest.png").write_bytes(b"my own picture")
    assert "rest.png already exists" in refused(mine, *words)


def test_a_foreign_report_is_refused_before_measuring(lab: VirtualLab, mine: Path) -> None:
    (mine / "out").mkdir()
    (mine / "out" / "report.html").write_text("mine")
    (mine / "truth").mkdir()
    compare = ("compare", lab.profile_path, "--input", mine / "in", "--truth", mine / "truth")
    assert "report.html already exists" in refused(mine, *compare, "--out", mine / "out")
    assert "report.html already exists" in refused(mine, "demo", "--out", mine / "out")
    assert "is --truth" in refused(mine, *compare, "--out", mine / "truth")


def test_an_empty_save_option_is_refused(lab: VirtualLab, mine: Path) -> None:
    assert "npz, tmd" in refused(mine, *run(lab, mine, "--out", mine / "out", "--save", ","))


def test_an_impossible_script_step_leaves_no_files_and_the_corrected_script_works(
    tmp_path: Path,
) -> None:
    script, out = tmp_path / "script.yaml", tmp_path / "deep" / "er"
    steps = (
        "steps:\n- indenter: {kind: sphere, diameter_mm: 4}\n- press: {depth_mm: 0.1, frames: 1}\n"
    )
    script.write_text(steps + "- press: {depth_mm: 90}\n")
    words = ("simulate", "hex_fingertip", "--mode", "fast", "--script", script, "--out", out)
    refused(tmp_path, *words)
    script.write_text(steps)
    done = tactile(*words)
    assert done.returncode == 0, done.stderr
    assert len(list((out / "truth").iterdir())) == 2
    assert [path.name for path in out.parent.iterdir()] == ["er"]


def test_a_full_disk_keeps_existing_files_and_exits_1(lab: VirtualLab, mine: Path) -> None:
    words = run(lab, mine, "--out", mine / "out")
    assert tactile(*words).returncode == 0
    before = held(mine)
    calibrated = calibrate(lab, "--presses", lab.presses, "--out", mine / "b")
    for command in (words, calibrated):
        done = tactile(*command, full_disk=True)
        assert done.returncode == 1
        assert done.stderr.startswith(b"tactile: File too large")
        assert held(mine) == before


def test_file_names_that_are_not_utf8_are_measured_and_saved(lab: VirtualLab, mine: Path) -> None:
    name = os.fsdecode(b"ball\xff.png")
    (mine / "in" / "ball.png").rename(mine / "in" / name)
    words = run(lab, mine, "--out", mine / "out", "--save", "npz,png,tmd,ply")
    done = tactile(*words, "--json")
    assert done.returncode == 0, done.stderr
    assert [json.loads(line)["source"] for line in done.stdout.splitlines()][1] == "rest"
    assert (mine / "out" / name).is_file()
    for encoding in ("utf-8", "latin-1"):
        done = tactile(*words, PYTHONIOENCODING=encoding)
        assert done.returncode == 0, done.stderr
        assert rb"ball\udcff" in done.stdout


def test_presses_with_names_that_are_not_utf8_give_a_bundle(lab: VirtualLab, mine: Path) -> None:
    presses = Path(shutil.copytree(lab.presses, mine / "presses"))
    (presses / "press_3.png").rename(presses / os.fsdecode(b"press_\xff.png"))
    lab.save(presses / "rest.png", None).rename(presses / os.fsdecode(b"rest\xff.png"))
    words = calibrate(lab, "--presses", presses, "--out", mine / os.fsdecode(b"new\xff"))
    done = tactile(*words, LC_ALL="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0")
    assert done.returncode == 0, done.stderr
    Bundle.load(mine / os.fsdecode(b"new\xff"))


@pytest.mark.parametrize("name", ["new.mcap", "new"])
def test_of_two_recordings_into_one_file_at_once_the_second_is_refused(
    lab: VirtualLab, mine: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("record", lab.profile_path, "--input", mine / "in", "--reference", "first")
    assert tactile(*words, "--out", mine / name).returncode == 0
    # the second looked before the first had made it
    monkeypatch.setattr("tactile_core.recordings.source.os.path.lexists", lambda path: False)
    assert f"{mine / name} already exists" in refused(mine, *words, "--out", mine / name)
