"""``tactile new`` on the command line."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from scaffold.pictures import photograph, sensor

from tactile_core.cli import main
from tactile_core.profiles.loader import load_profile


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Enter an empty folder with one picture of a sensor without contact."""
    photograph(sensor(), tmp_path / "reference.png")
    monkeypatch.chdir(tmp_path)
    return tmp_path


New = Callable[..., tuple[int, str, str]]


@pytest.fixture
def new(folder: Path, capsys: pytest.CaptureFixture[str]) -> New:
    """Return a function that runs the command and returns exit code, stdout and stderr."""

    def run(*words: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as end:
            main(["new", *words])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return int(end.value.code or 0), captured.out, captured.err

    return run


MINE = ("mine", "--from", "hex_fingertip_unmarked", "--image", "reference.png")


def test_the_path_goes_to_stdout_and_messages_to_stderr(new: New, folder: Path) -> None:
    code, out, message = new(*MINE, "--scale", "calliper:5@20,30,52,54")
    assert (code, out) == (0, "mine.yaml\n")
    assert "tactile calibrate mine.yaml --presses FOLDER --reference reference.png" in message
    assert "NOT MEASURED" not in message
    assert load_profile(folder / "mine.yaml").image.mm_per_px == 0.125


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--from", "hex_fingertp", "--image", "reference.png"), "did you mean 'hex_fingertip'?"),
        (("--from", "hex_fingertip", "--image", "gone.png"), "gone.png"),
        (("--from", "hex_fingertip", "--image", "note.png"), "note.png"),
        (("--from", "hex_fingertip"), "--image"),
        ((*MINE[1:], "--scale", "calliper:10"), "--scale-image"),
        ((*MINE[1:], "--scale", "0.1", "--scale-image", "reference.png"), "grid:2"),
        ((*MINE[1:], "--scale", "markers:1"), "shows no markers"),
        (
            (*MINE[1:], "--scale", "grid:2", "--scale-image", "reference.png"),
            "shows no grid of lines, checks or dots",
        ),
        (
            (*MINE[1:], "--scale", "balls:6", "--scale-image", "reference.png"),
            "no two equal imprints",
        ),
    ],
)
def test_unusable_input_is_refused_and_nothing_is_written(
    new: New, folder: Path, words: tuple[str, ...], message: str
) -> None:
    (folder / "note.png").write_text("no picture")
    before = sorted(folder.iterdir())
    code, out, error = new("mine", *words)
    assert (code, out) == (2, "")
    assert message in error
    assert sorted(folder.iterdir()) == before


def test_existing_files_are_overwritten_only_with_force(new: New, folder: Path) -> None:
    (folder / "mine.yaml").write_text("precious")
    code, _, message = new(*MINE)
    assert (code, (folder / "mine.yaml").read_text()) == (2, "precious")
    assert "--force" in message
    code, _, _ = new(*MINE, "--force")
    assert code == 0
    assert load_profile(folder / "mine.yaml").name == "mine"


def test_a_package_is_written_into_its_own_folder(new: New, folder: Path) -> None:
    code, out, message = new(*MINE, "--plugin")
    assert (code, out) == (0, "tactile-mine\n")
    assert "pip install -e tactile-mine" in message
    profile = folder / "tactile-mine" / "tactile_mine" / "profiles" / "mine.yaml"
    assert load_profile(profile, components=False).estimators["deepest"].use == "mine.deepest"
    assert new(*MINE, "--plugin")[0] == 2


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_on_a_terminal_the_command_asks_for_the_scale(folder: Path) -> None:
    keyboard, terminal = pty.openpty()
    os.write(keyboard, b"0.125\n")
    done = subprocess.run(
        [sys.executable, "-m", "tactile_core.cli", "new", *MINE],
        cwd=folder,
        stdin=terminal,
        capture_output=True,
        text=True,
        check=False,
    )
    os.close(keyboard)
    os.close(terminal)
    assert (done.returncode, done.stdout) == (0, "mine.yaml\n"), done.stderr
    assert "How many mm" in done.stderr
    assert load_profile(folder / "mine.yaml").image.mm_per_px == 0.125
