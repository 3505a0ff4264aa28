"""Folders take their place in one step, and none is deleted before the new one is there."""

from __future__ import annotations

import errno
import threading
from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.formats import folders
from tactile_core.formats.folders import (
    fresh_folder,
    make_folder,
    move_in,
    rename_new,
    replace_folder,
)


def files_of(folder: Path) -> list[Path]:
    """Every file may be replaced but one called 'mine'."""
    files = list(folder.iterdir()) if folder.is_dir() else []
    if folder / "mine" in files:
        raise InputError(f"{folder} holds mine")
    return files


def write(place: Path, text: str) -> None:
    with fresh_folder(place) as fresh:
        (fresh / "file").write_text(text)
        replace_folder(fresh, place, files_of)


@pytest.fixture(params=["one step", "two renames"])
def renames(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both ways to replace a folder: with the system's help and without."""
    if request.param == "two renames":
        monkeypatch.setattr(folders, "_renameat2", lambda: None)
    return str(request.param)


def test_a_folder_comes_to_a_place_that_is_absent_empty_or_taken(
    renames: str, tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    for name in ("absent", "empty"):
        for text in ("one", "two"):
            write(tmp_path / name, text)
            assert (tmp_path / name / "file").read_text() == text
    assert sorted(path.name for path in tmp_path.iterdir()) == ["absent", "empty"]


def test_what_may_not_be_replaced_stays(renames: str, tmp_path: Path) -> None:
    write(tmp_path / "a", "one")
    (tmp_path / "a" / "mine").write_text("mine")
    with pytest.raises(InputError):
        write(tmp_path / "a", "two")
    assert (tmp_path / "a" / "file").read_text() == "one"
    assert list(tmp_path.iterdir()) == [tmp_path / "a"]


def test_when_the_new_folder_cannot_be_put_there_the_old_one_is_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folders, "_renameat2", lambda: None)
    write(tmp_path / "a", "one")
    rename, refused = Path.rename, []

    def failing(self: Path, target: Path) -> Path:
        if target == tmp_path / "a" and (self / "file").read_text() == "two" and len(refused) < 2:
            refused.append(self)
            # at the first attempt it is still taken, as by any rename of a folder
            raise OSError(errno.EIO if len(refused) > 1 else errno.ENOTEMPTY, "no")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(OSError, match="no"):
        write(tmp_path / "a", "two")
    assert len(refused) == 2
    assert (tmp_path / "a" / "file").read_text() == "one"
    assert list(tmp_path.iterdir()) == [tmp_path / "a"]


def test_when_it_cannot_be_put_back_either_it_is_kept_and_its_place_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folders, "_renameat2", lambda: None)
    write(tmp_path / "a", "one")
    rename = Path.rename

    def failing(self: Path, target: Path) -> Path:
        if target == tmp_path / "a":
            raise OSError(errno.ENOTEMPTY if target.exists() else errno.EIO, "no")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(OSError, match="could not be replaced; what was there is now") as raised:
        write(tmp_path / "a", "two")
    kept = Path(str(raised.value.strerror).rpartition(" is now ")[2])
    assert (kept / "file").read_text() == "one"
    assert list(tmp_path.iterdir()) == [kept]


def test_of_many_writers_at_once_one_stays_whole(tmp_path: Path) -> None:
    place, errors = tmp_path / "a", []

    def writer(number: int) -> None:
        try:
            for _ in range(50):
                write(place, str(number))
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=writer, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert [path.name for path in place.iterdir()] == ["file"]
    assert list(tmp_path.iterdir()) == [place]


def test_what_fails_leaves_neither_the_folder_nor_the_parents_made_for_it(tmp_path: Path) -> None:
    def fails() -> None:
        with fresh_folder(tmp_path / "a" / "b" / "c") as fresh:
            (fresh / "file").write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fails()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_as_readable_as_the_umask_lets(tmp_path: Path) -> None:
    (tmp_path / "plain").mkdir()
    write(tmp_path / "a", "one")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_place_below_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "a" / "b"):
        with pytest.raises(InputError, match=r"file is a file; name a folder"):
            make_folder(folder)


def test_nothing_is_moved_over_what_is_there(renames: str, tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(name)
        (tmp_path / f"{name}.txt").write_text(name)
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(FileExistsError):
        move_in(tmp_path / "one", tmp_path / "two")
    for taken in ("two.txt", "link"):
        with pytest.raises(FileExistsError):
            rename_new(tmp_path / "one.txt", tmp_path / taken)
    rename_new(tmp_path / "one.txt", tmp_path / "three.txt")
    assert (tmp_path / "two" / "file").read_text() == (tmp_path / "two.txt").read_text() == "two"
    assert (tmp_path / "three.txt").read_text() == "one"
