"""Folders are replaced in one step: the old one is deleted only after the new one is in place."""

from __future__ import annotations

import errno
import threading
from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.formats import folders
from tactile_core.formats.folders import (
    FilesOf,
    fresh_folder,
    make_folder,
    move_in,
    rename_new,
    replace_folder,
    resolve_links,
)


def files_of(folder: Path) -> list[Path]:
    """Return the files if none is called 'mine', which must not be replaced."""
    files = list(folder.iterdir()) if folder.is_dir() else []
    if folder / "mine" in files:
        raise InputError(f"{folder} contains mine")
    return files


def write(place: Path, text: str, replaceable: FilesOf = files_of) -> None:
    with fresh_folder(place) as fresh:
        (fresh / "file").write_text(text)
        replace_folder(fresh, place, replaceable)


@pytest.fixture(params=["one step", "two renames"])
def renames(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both ways to replace a folder: with and without ``renameat2``."""
    if request.param == "two renames":
        monkeypatch.setattr(folders, "_renameat2", lambda: None)
    return str(request.param)


def test_a_folder_replaces_an_absent_empty_or_existing_folder(renames: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for name in ("absent", "empty"):
        for text in ("one", "two"):
            write(tmp_path / name, text)
            assert (tmp_path / name / "file").read_text() == text
    assert sorted(path.name for path in tmp_path.iterdir()) == ["absent", "empty"]


def test_a_folder_with_other_files_is_not_replaced(renames: str, tmp_path: Path) -> None:
    write(tmp_path / "a", "one")
    (tmp_path / "a" / "mine").write_text("mine")
    with pytest.raises(InputError):
        write(tmp_path / "a", "two")
    assert (tmp_path / "a" / "file").read_text() == "one"
    assert list(tmp_path.iterdir()) == [tmp_path / "a"]


def test_the_old_folder_is_restored_when_the_new_one_cannot_be_moved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folders, "_renameat2", lambda: None)
    write(tmp_path / "a", "one")
    rename, refused = Path.rename, []

    def failing(self: Path, target: Path) -> Path:
        if target == tmp_path / "a" and (self / "file").read_text() == "two" and len(refused) < 2:
            refused.append(self)
            # the first attempt finds the path occupied, as any rename of a folder does
            raise OSError(errno.EIO if len(refused) > 1 else errno.ENOTEMPTY, "no")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(OSError, match="no"):
        write(tmp_path / "a", "two")
    assert len(refused) == 2
    assert (tmp_path / "a" / "file").read_text() == "one"
    assert list(tmp_path.iterdir()) == [tmp_path / "a"]


def test_an_old_folder_that_cannot_be_restored_is_kept_and_named(
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
    with pytest.raises(OSError, match="could not be replaced; the old folder is now") as raised:
        write(tmp_path / "a", "two")
    kept = Path(str(raised.value.strerror).rpartition(" is now ")[2])
    assert (kept / "file").read_text() == "one"
    assert list(tmp_path.iterdir()) == [kept]


def test_concurrent_writers_leave_one_complete_folder(tmp_path: Path) -> None:
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


def test_a_failure_removes_the_folder_and_the_parents_created_for_it(tmp_path: Path) -> None:
    def fails() -> None:
        with fresh_folder(tmp_path / "a" / "b" / "c") as fresh:
            (fresh / "file").write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fails()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_has_the_permissions_of_the_umask(tmp_path: Path) -> None:
    (tmp_path / "plain").mkdir()
    write(tmp_path / "a", "one")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_folder_below_a_file_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "a" / "b"):
        with pytest.raises(InputError, match=r"file is a file; name a folder"):
            make_folder(folder)


def test_existing_files_and_folders_are_not_overwritten(renames: str, tmp_path: Path) -> None:
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


@pytest.mark.parametrize("call", [1, 2, 3])
def test_an_interruption_leaves_one_complete_folder_and_no_temporary_one(
    renames: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: int
) -> None:
    write(tmp_path / "a", "one")
    calls = 0

    def interrupted(*_: object, **__: object) -> None:
        nonlocal calls
        calls += 1
        if calls == call:
            raise KeyboardInterrupt

    def replaceable(folder: Path) -> list[Path]:
        interrupted()
        return files_of(folder)

    unlink = Path.unlink

    def unlinked(path: Path, missing_ok: bool = False) -> None:
        interrupted()
        unlink(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", unlinked)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "a", "two", replaceable)
    assert list(tmp_path.iterdir()) == [tmp_path / "a"]
    assert (tmp_path / "a" / "file").read_text() in ("one", "two")


def test_a_link_is_resolved_even_if_its_target_does_not_exist(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("there")
    assert resolve_links(tmp_path / "link") == tmp_path / "there"


@pytest.mark.parametrize("name", ["loop", "loop/below"])
def test_a_loop_of_links_is_rejected(tmp_path: Path, name: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(InputError, match="loop of links"):
        resolve_links(tmp_path / name)
