"""Words that can be no path are refused before anything is opened."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.cli import main
from tactile_core.cli.paths import refuse_impossible
from tactile_core.errors import InputError


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    said = capsys.readouterr()
    assert (ended.value.code, said.out) == (2, "")
    assert said.err.startswith("tactile: ")
    assert said.err.count("\n") == 1
    return said.err


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
def test_an_empty_word_does_not_mean_the_folder_here(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    named: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert f"{named} is empty" in refused(capsys, *words)


@pytest.mark.parametrize("name", ["x" * 256, "ü" * 128, "folder/" + "x" * 300 + "/b.png"])
def test_a_name_that_no_file_system_takes_is_refused(
    capsys: pytest.CaptureFixture[str], name: str
) -> None:
    for words in (["--input", name], [f"--input={name}"], ["--input", "a.png", "--out", name]):
        assert "255 bytes" in refused(capsys, "run", "wedge", *words)


def test_what_may_stand_there_passes() -> None:
    refuse_impossible(["run", "a=", "--sim", "--input", "x" * 255, "--out=" + "x/" * 500])
    with pytest.raises(InputError, match="an argument is empty"):
        refuse_impossible(["run", ""])
