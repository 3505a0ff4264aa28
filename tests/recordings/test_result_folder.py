"""The results of a recording appear all at once, and replace only what a command wrote."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.recordings.output_folder import MEASURED, WRITTEN, complete_results, report_of


def fill(place: Path, text: str = "one") -> None:
    with complete_results(place, text) as (folder, report):
        folder.write("a.txt", lambda path: path.write_text(text) and None)
        report["text"] = text
        assert not (place / MEASURED).exists() or report_of(place, text) is None


def test_results_and_their_report_appear_together(tmp_path: Path) -> None:
    fill(tmp_path / "out")
    files = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert files == [WRITTEN, "a.txt", MEASURED]
    report = report_of(tmp_path / "out", "one")
    assert report is not None
    assert report["text"] == "one"


def test_results_of_other_options_are_replaced(tmp_path: Path) -> None:
    fill(tmp_path / "out", "one")
    assert report_of(tmp_path / "out", "two") is None
    fill(tmp_path / "out", "two")
    assert (tmp_path / "out" / "a.txt").read_text() == "two"


def test_a_failure_leaves_the_results_of_before(tmp_path: Path) -> None:
    fill(tmp_path / "out", "one")
    with pytest.raises(OSError, match="full"), complete_results(tmp_path / "out", "two"):
        raise OSError("full")
    assert report_of(tmp_path / "out", "one") is not None
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("change", ["added", "edited"])
def test_files_of_the_user_are_never_replaced(tmp_path: Path, change: str) -> None:
    fill(tmp_path / "out", "one")
    name = "a.txt" if change == "edited" else "notes.txt"
    (tmp_path / "out" / name).write_text("mine!")
    with pytest.raises(InputError, match=f"{name} is not as tactile wrote it"):
        fill(tmp_path / "out", "two")
    assert (tmp_path / "out" / name).read_text() == "mine!"
    assert (tmp_path / "out" / MEASURED).exists()


def test_results_from_which_a_file_was_deleted_are_incomplete(tmp_path: Path) -> None:
    fill(tmp_path / "out")
    (tmp_path / "out" / "a.txt").unlink()
    assert report_of(tmp_path / "out", "one") is None


def test_copied_results_are_complete(tmp_path: Path) -> None:
    fill(tmp_path / "out")
    shutil.copytree(tmp_path / "out", tmp_path / "copy", copy_function=shutil.copyfile)
    assert report_of(tmp_path / "copy", "one") is not None


def test_other_folders_have_no_results(tmp_path: Path) -> None:
    assert report_of(tmp_path, "one") is None
    (tmp_path / MEASURED).write_text("[]")
    assert report_of(tmp_path, "one") is None
