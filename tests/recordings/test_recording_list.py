"""A folder of recordings is never mistaken for a recording, nor the reverse."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats.images import write_png
from tactile_core.recordings.recording import open_recording
from tactile_core.recordings.recovery import (
    is_folder_of_recordings,
    list_recordings,
    unread_recordings,
)


def picture(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(path, np.zeros((6, 8, 3), np.uint8))
    return path


def scan(folder: Path) -> Path:
    picture(folder / "a.png")
    (folder / "scan.yaml").write_text("images: [a.png]\n")
    return folder


def names(*paths: Path, count: int = 1) -> list[str]:
    return [one.name for one in list_recordings(paths, images_per_observation=count)]


def test_folders_of_images_and_files_in_a_folder_are_a_recording_each(tmp_path: Path) -> None:
    for name in ("lift_10", "lift_2"):
        picture(tmp_path / name / "0.png")
    for name in ("slide.mp4", "grasp.mcap", "twist.h5", "notes.txt", ".hidden.mp4"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "empty").mkdir()
    assert is_folder_of_recordings(tmp_path)
    assert names(tmp_path) == ["grasp", "lift_2", "lift_10", "slide", "twist"]


@pytest.mark.parametrize("kind", ["images", "images and videos", "scan", "scans", "one image"])
def test_what_is_one_recording_stays_one(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "input"
    if kind == "scan":
        scan(path)
    elif kind == "scans":
        scan(path / "one")
        scan(path / "two")
    else:
        image = picture(path / "0.png")
        path = image if kind == "one image" else path
    if kind == "images and videos":
        (path / "slide.mp4").write_bytes(b"")
        assert [one.name for one in unread_recordings(path)] == ["slide.mp4"]
    assert open_recording(path).count
    assert not is_folder_of_recordings(path)
    assert list_recordings([path])[0].path == path


def test_folders_with_an_image_per_light_are_the_observations_of_one_recording(
    tmp_path: Path,
) -> None:
    for sequence in ("press_1", "press_2"):
        for light in range(3):
            picture(tmp_path / "grasp" / sequence / f"{light}.png")
    assert names(tmp_path / "grasp", count=3) == ["grasp"]
    assert names(tmp_path, count=3) == ["grasp"]
    assert is_folder_of_recordings(tmp_path, images_per_observation=3)
    # with simultaneous lights, each of the folders is a recording
    assert names(tmp_path / "grasp") == ["press_1", "press_2"]


def test_several_paths_are_listed_in_their_order(tmp_path: Path) -> None:
    first, second = picture(tmp_path / "b.png"), scan(tmp_path / "a")
    assert names(first, second / "scan.yaml") == ["b", "a"]
    assert names(first, first) == ["b"]


def test_two_recordings_of_one_name_are_refused(tmp_path: Path) -> None:
    for folder in ("monday", "tuesday"):
        picture(tmp_path / folder / "lift" / "0.png")
    with pytest.raises(InputError, match=r"monday/lift and .*tuesday/lift .* rename one"):
        list_recordings([tmp_path / "monday", tmp_path / "tuesday"])


def test_a_folder_without_recordings_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no recording")
    assert not is_folder_of_recordings(tmp_path)
    with pytest.raises(InputError, match="contains no recording"):
        list_recordings([tmp_path])
