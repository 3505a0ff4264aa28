"""``tactile new`` as a user types it."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest
from scaffold.pictures import photograph, sensor

from tactile_core.profiles.loader import load_profile

PROGRAM = (sys.executable, "-m", "tactile_core.cli", "new")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An empty folder, but for a picture of an untouched sensor."""
    photograph(sensor(), tmp_path / "untouched.png")
    return tmp_path


def new(folder: Path, *words: str, stdin: int = subprocess.DEVNULL) -> tuple[int, str, str]:
    """Run the command in a folder; exit code, stdout and stderr."""
    done = subprocess.run(
        [*PROGRAM, *words],
        cwd=folder,
        stdin=stdin,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Traceback" not in done.stderr
    return done.returncode, done.stdout, done.stderr


MINE = ("mine", "--from", "hex_fingertip_unmarked", "--image", "untouched.png")


def test_the_path_goes_to_stdout_and_words_to_stderr(folder: Path) -> None:
    code, out, said = new(folder, *MINE, "--known-mm", "5", "--known-px", "20,30,52,54")
    assert (code, out) == (0, "mine.yaml\n")
    assert "tactile calibrate mine.yaml" in said
    assert "NOT MEASURED" not in said
    assert load_profile(folder / "mine.yaml").image.mm_per_px == 0.125


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--from", "hex_fingertp", "--image", "untouched.png"), "did you mean 'hex_fingertip'?"),
        (("--from", "hex_fingertip", "--image", "gone.png"), "gone.png"),
        (("--from", "hex_fingertip", "--image", "note.png"), "note.png"),
        (("--from", "hex_fingertip"), "--image"),
        ((*MINE[1:], "--known-mm", "10"), "--known-px"),
        ((*MINE[1:], "--marker-pitch-mm", "1"), "no lattice of marks"),
        ((*MINE[1:], "--presses", "."), "--ball-diameter-mm"),
        ((*MINE[1:], "--ball-diameter-mm", "4"), "--presses"),
    ],
)
def test_what_cannot_be_used_is_refused_and_nothing_written(
    folder: Path, words: tuple[str, ...], said: str
) -> None:
    (folder / "note.png").write_text("no picture")
    before = sorted(folder.iterdir())
    code, out, error = new(folder, "mine", *words)
    assert (code, out) == (2, "")
    assert said in error
    assert sorted(folder.iterdir()) == before


def test_nothing_is_overwritten_but_by_force(folder: Path) -> None:
    (folder / "mine.yaml").write_text("precious")
    code, _, said = new(folder, *MINE)
    assert (code, (folder / "mine.yaml").read_text()) == (2, "precious")
    assert "--force" in said
    code, _, _ = new(folder, *MINE, "--force")
    assert code == 0
    assert load_profile(folder / "mine.yaml").name == "mine"


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_at_a_terminal_the_scale_is_asked_for(folder: Path) -> None:
    keyboard, terminal = pty.openpty()
    os.write(keyboard, b"0.125\n")
    code, out, said = new(folder, *MINE, stdin=terminal)
    os.close(keyboard)
    os.close(terminal)
    assert (code, out) == (0, "mine.yaml\n")
    assert "How many mm" in said
    assert load_profile(folder / "mine.yaml").image.mm_per_px == 0.125
