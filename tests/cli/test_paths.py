"""Empty words and overlong names are refused before anything is opened."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.cli import main
from tactile_core.cli.output import refuse_impossible
from tactile_core.errors import InputError


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    with pytest.raises(SystemExit) as end:
        main(list(words))
    captured = capsys.readouterr()
    assert (end.value.code, captured.out) == (2, "")
    assert captured.err.startswith("tactile: ")
    assert captured.err.count("\n") == 1
    return captured.err


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["run", "wedge", "--input", ""], "--input"),
        (["run", "wedge", "--input="], "--input"),
        (["run", "wedge", "--save", ""], "--save"),
        (["calibrate", "wedge", "--presses", "p", "--model", ""], "--model"),
        (["validate", ""], "an argument"),
    ],
)
def test_an_empty_word_is_refused(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    named: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert f"{named} is empty" in refused(capsys, *words)


@pytest.mark.parametrize("name", ["x" * 256, "ü" * 128, "folder/" + "x" * 300 + "/b.png"])
def test_a_name_too_long_for_file_systems_is_refused(
    capsys: pytest.CaptureFixture[str], name: str
) -> None:
    for words in (["--input", name], [f"--input={name}"], ["--input", "a.png", "--out", name]):
        assert "255 bytes" in refused(capsys, "run", "wedge", *words)


def test_valid_words_pass() -> None:
    refuse_impossible(["run", "a=", "--sim", "--input", "x" * 255, "--out=" + "x/" * 500])
    with pytest.raises(InputError, match="an argument is empty"):
        refuse_impossible(["run", ""])
