"""``tactile train-force``: what it refuses before it trains."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.command_line import tactile


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([], "give either --sim, or --input with --forces"),
        (["--sim", "--input", "frames"], "give either --sim, or --input with --forces"),
        (["--input", "frames"], "--input needs --forces"),
    ],
)
def test_unusable_arguments_are_refused(tmp_path: Path, given: list[str], words: str) -> None:
    out = tmp_path / "network"
    done = tactile("train-force", "hex_fingertip", "--out", out, *given)
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
    assert not out.exists()
