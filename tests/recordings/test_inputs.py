"""Outputs of a command never overwrite its inputs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.recordings.inputs import Inputs


@pytest.fixture
def given(tmp_path: Path) -> Inputs:
    """A folder of presses, an image in a second folder, and a profile in a third."""
    for path in ("presses/a.png", "ref/b.png", "mine/mine.yaml"):
        (tmp_path / path).parent.mkdir()
        (tmp_path / path).write_text("mine")
    return Inputs.from_paths(
        {
            "--presses": tmp_path / "presses",
            "--reference": str(tmp_path / "ref" / "b.png"),
            "the profile": tmp_path / "mine" / "mine.yaml",
            "--labels": None,
            "--bundle": tmp_path / "gone",
        }
    )


def names(folder: Path, path: str) -> list[Path]:
    """Return a path, the same path with '..' in it, and a link to it."""
    link = folder / "link"
    link.symlink_to(folder / path)
    return [folder / path, folder / "presses" / ".." / path, link]


def test_a_replaced_folder_must_not_be_or_contain_an_input(given: Inputs, tmp_path: Path) -> None:
    for name in names(tmp_path, "presses"):
        with pytest.raises(InputError, match=r"--out .* is --presses .* itself"):
            given.refuse_whole(name)
    with pytest.raises(InputError, match=r"contains --reference .* would be lost"):
        given.refuse_whole(tmp_path / "ref")
    with pytest.raises(InputError, match="contains the profile"):
        given.refuse_whole(tmp_path / "mine")
    with pytest.raises(InputError, match="contains --presses"):
        given.refuse_whole(tmp_path)
    given.refuse_whole(tmp_path / "other")
    given.refuse_whole(tmp_path / "presses" / "bundle")


def test_a_result_folder_must_not_be_or_contain_a_recording(given: Inputs, tmp_path: Path) -> None:
    for name in names(tmp_path, "ref"):
        with pytest.raises(InputError, match=r"contains --reference .* could overwrite"):
            given.refuse_shared(name)
    with pytest.raises(InputError, match="itself"):
        given.refuse_shared(tmp_path / "presses")
    given.refuse_shared(tmp_path)
    given.refuse_shared(tmp_path / "mine")
    given.refuse_shared(tmp_path / "presses" / "results")


def test_an_output_file_must_not_be_a_link_to_an_input(given: Inputs, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is the profile"):
        given.refuse_file(tmp_path / "mine" / "mine.yaml")
    (tmp_path / "hard.png").hardlink_to(tmp_path / "ref" / "b.png")
    with pytest.raises(InputError, match="is --reference"):
        given.refuse_file(tmp_path / "hard.png")
    (tmp_path / "soft.png").symlink_to(tmp_path / "presses" / "a.png")
    with pytest.raises(InputError, match="is one of --presses"):
        given.refuse_file(tmp_path / "soft.png")
    given.refuse_file(tmp_path / "mine" / "other.yaml")
