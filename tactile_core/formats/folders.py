"""Folders that are written beside their place and then take it in one step."""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import sys
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.unfinished import beside, remove_leftovers, replaced

FilesOf = Callable[[Path], Collection[Path]]
"""The files of a folder if all that it holds may be replaced; else an InputError.

The last of them is the one by which the others are known.
"""

_AT_FDCWD, _NOREPLACE, _EXCHANGE = -100, 1, 2
_UNABLE = frozenset({errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EPERM})
_OCCUPIED = frozenset({errno.ENOTEMPTY, errno.EEXIST})
_ATTEMPTS = 100


def make_folder(folder: Path) -> None:
    """Make a folder and its parents where they are not there.

    Raises
    ------
    InputError
        It, or a parent, is a file.
    OSError
        The disk is full or refuses.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        file = next((part for part in (folder, *folder.parents) if part.is_file()), folder)
        raise InputError(f"{file} is a file; name a folder") from None


def led_to(path: Path) -> Path:
    """Where a path leads if its links are followed, whether there is something or not.

    Raises
    ------
    InputError
        The links lead back to themselves.
    """
    place = Path(os.path.realpath(path))
    if any(part.is_symlink() for part in (place, *place.parents)):
        raise InputError(f"{path} leads into a circle of links; name a folder")
    return place


@contextmanager
def fresh_folder(place: Path) -> Iterator[Path]:
    """Yield a new folder beside ``place``, for the caller to fill and then to move there.

    On failure it is removed, with the parents that were made for it. So is what killed processes
    left unfinished beside the place.
    """
    if os.path.ismount(place):
        raise InputError(f"{place} is where a disk is mounted; name a folder in it")
    made = [folder for folder in place.parents if not folder.exists()]
    make_folder(place.parent)
    remove_leftovers(place.parent)
    fresh = beside(place)
    try:
        fresh.mkdir()
        yield fresh
    except BaseException:
        shutil.rmtree(fresh, ignore_errors=True)
        for folder in made:
            with suppress(OSError):
                folder.rmdir()
        raise


def move_in(fresh: Path, place: Path) -> None:
    """Move a folder to a place where there is nothing, or an empty folder.

    Raises
    ------
    FileExistsError
        There is something.
    """
    try:
        fresh.rename(place)
    except OSError as error:
        if error.errno in _OCCUPIED:
            raise FileExistsError(errno.EEXIST, "there is something already", str(place)) from None
        raise


def replace_folder(fresh: Path, place: Path, files_of: FilesOf) -> None:
    """Move a folder to its place; at no moment is there neither it nor what was there before.

    Parameters
    ----------
    fresh : Path
        Beside ``place``.
    place : Path
        Absent, empty, or a folder that may be replaced.
    files_of : callable
        Asked before the folder at ``place`` is replaced, and again before its files are deleted.

    Raises
    ------
    InputError
        Of ``files_of``; what was there is still there.
    OSError
        A folder cannot be renamed; the message says where the former one is, if not at its place.
    """
    for _ in range(_ATTEMPTS):
        with suppress(FileExistsError):
            move_in(fresh, place)
            break
        files_of(place)
        with suppress(FileNotFoundError):  # another process has just taken it away
            _replace(fresh, place, files_of)
            break
    else:
        raise OSError(errno.EBUSY, f"{place} is written by others all the time; try again")
    for former in replaced(place):
        with suppress(InputError, OSError):
            _delete(former, files_of(former))


def _replace(fresh: Path, place: Path, files_of: FilesOf) -> None:
    spare = beside(place, "old")
    fresh.rename(spare)
    try:
        _change_places(spare, place)
    except OSError:
        spare.rename(fresh)
        raise
    # in between, somebody may have put a file of his own into the former folder
    try:
        files = files_of(spare)
    except BaseException:
        _change_places(spare, place)
        spare.rename(fresh)
        raise
    try:
        _delete(spare, files)
    except KeyboardInterrupt:
        # the new folder is in its place: only what remains of the former one is still in the way
        _delete(spare, files)
        raise


def _delete(folder: Path, files: Collection[Path]) -> None:
    """Delete these files and folders that are empty then, and nothing that has come since."""
    for file in files:
        file.unlink(missing_ok=True)
    inside = {parent for file in files for parent in file.parents if folder in parent.parents}
    try:
        for parent in sorted(inside, key=lambda path: -len(path.parts)):
            parent.rmdir()
        folder.rmdir()
    except OSError as error:
        if error.errno not in _OCCUPIED:
            raise
        raise OSError(
            error.errno,
            f"a file came into a folder while it was replaced; it is kept in {folder}",
        ) from None


def _change_places(one: Path, other: Path) -> None:
    """Exchange two folders, in one step where the system and the disk are able to."""
    try:
        _renamed(one, other, _EXCHANGE)
        return
    except OSError as error:
        if error.errno not in _UNABLE:
            raise
    aside = beside(other, "old")
    other.rename(aside)
    try:
        one.rename(other)
    except BaseException as error:
        try:
            aside.rename(other)
        except OSError:
            number = error.errno if isinstance(error, OSError) else errno.EIO
            raise OSError(
                number, f"{other} could not be replaced; what was there is now {aside}"
            ) from error
        raise
    aside.rename(one)


def rename_new(fresh: Path, path: Path) -> None:
    """Rename a file to a name that nothing has.

    Raises
    ------
    FileExistsError
        Something has it.
    """
    try:
        _renamed(fresh, path, _NOREPLACE)
        return
    except OSError as error:
        if error.errno not in _UNABLE:
            raise
    if os.path.lexists(path):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    fresh.rename(path)


def _renamed(one: Path, other: Path, flag: int) -> None:
    rename = _renameat2()
    if rename is None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))
    if rename(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), flag) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(one), None, str(other))


@cache
def _renameat2() -> Any:
    """Linux's rename with flags; None elsewhere and with a C library that lacks it."""
    if sys.platform != "linux":
        return None
    found = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if found is not None:
        found.argtypes = [
            *(ctypes.c_int, ctypes.c_char_p),
            *(ctypes.c_int, ctypes.c_char_p, ctypes.c_uint),
        ]
    return found
