"""``tactile calibrate`` asks once how ball and scale were measured, and the bundle says it."""

from __future__ import annotations

import os
import pty
import shutil
from pathlib import Path
from unittest.mock import patch

import pytest
from support.command_line import tactile
from support.virtual_lab import VirtualLab

from tactile_core.bundles.manifest import read_manifest

ANSWER = "gauge block, 1 µm"


def calibrated(lab: VirtualLab, out: Path, *words: str, typed: str | None) -> tuple[str, str]:
    """Calibrate with a keyboard or without; what the bundle says, and stderr."""
    presses = out.with_name("presses")
    presses.mkdir()
    for path in sorted(lab.presses.iterdir())[:3]:  # of ten, as how well they fit is not asked
        shutil.copy(path, presses)
    command = ["calibrate", lab.profile_path, "--presses", presses, "--out", out, *words]
    command += ["--reference", lab.reference, "--ball-diameter-mm", 4, "--model", "core.polynomial"]
    keyboard, terminal = pty.openpty()
    os.write(keyboard, f"{typed}\n".encode())
    stdin = os.open(os.devnull, os.O_RDONLY) if typed is None else os.dup(terminal)
    with os.fdopen(stdin) as given, patch("sys.stdin", given):
        done = tactile(*command)
    os.close(keyboard)
    os.close(terminal)
    assert done.returncode == 0, done.stderr
    return read_manifest(out).measured_with, done.stderr


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_on_a_terminal_the_answer_is_stored_and_reported(lab: VirtualLab, tmp_path: Path) -> None:
    said, message = calibrated(lab, tmp_path / "b", typed=ANSWER)
    assert said == ANSWER
    assert message.count("measured, e.g. 'calliper, 0.02 mm'") == 1
    assert ANSWER in (tmp_path / "b" / "report.html").read_text(encoding="utf-8")


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
@pytest.mark.parametrize(
    ("words", "typed", "stored"),
    [
        (("--measured-with", ANSWER), "not this", ANSWER),
        (("--json",), "not this", ""),
        ((), None, ""),
        ((), "", ""),
    ],
    ids=["given", "json", "no terminal", "no answer"],
)
def test_otherwise_nothing_is_asked_or_it_is_unknown(
    lab: VirtualLab, tmp_path: Path, words: tuple[str, ...], typed: str | None, stored: str
) -> None:
    said, message = calibrated(lab, tmp_path / "b", *words, typed=typed)
    assert said == stored
    assert ("measured, e.g." in message) == (typed == "")
    report = (tmp_path / "b" / "report.html").read_text(encoding="utf-8")
    assert (stored or "unknown") in report
