"""Folders that are written under a temporary name and then renamed in one step."""

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
from tactile_core.formats.files import find_replaced, remove_leftovers, temporary_path

# Returns the files of a folder whose whole content may be replaced; else raises an InputError. The
# last file lists the others, so it is deleted last.
FilesOf = Callable[[Path], Collection[Path]]

_AT_FDCWD, _NOREPLACE, _EXCHANGE = -100, 1, 2  # Arguments of Linux's `renameat2`

# Errors of a system or disk without `renameat2`.
_UNSUPPORTED = frozenset({errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EPERM})

# Errors of renaming a folder to a folder that is not empty.
_OCCUPIED = frozenset({errno.ENOTEMPTY, errno.EEXIST})


def make_folder(folder: Path) -> None:
    """Create a folder and its parents unless they exist.

    Raises
    ------
    InputError
        The path or a parent is a file.
    OSError
        The disk is full or not writable.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        file = next((part for part in (folder, *folder.parents) if part.is_file()), folder)
        raise InputError(f"{file} is a file; name a folder") from None


def resolve_links(path: Path) -> Path:
    """Return the absolute path with all links followed; its target need not exist.

    Raises
    ------
    InputError
        The links form a loop.
    """
    place = Path(os.path.realpath(path))
    if any(part.is_symlink() for part in (place, *place.parents)):
        raise InputError(f"{path} is a loop of links; name a folder")
    return place


@contextmanager
def fresh_folder(place: Path) -> Iterator[Path]:
    """Yield a new folder next to ``place``, for the caller to fill and then to move there.

    If the caller fails, the folder is removed together with the parents that were created for it.
    Unfinished folders of killed processes are removed too.
    """
    if os.path.ismount(place):
        raise InputError(f"{place} is the mount point of a disk; name a folder in it")
    made = [folder for folder in place.parents if not folder.exists()]
    make_folder(place.parent)
    remove_leftovers(place.parent)
    fresh = temporary_path(place)
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
    """Move a folder to a path that does not exist or is an empty folder.

    Raises
    ------
    FileExistsError
        The path is a file or a folder that is not empty.
    """
    try:
        fresh.rename(place)
    except OSError as error:
        if error.errno in _OCCUPIED:
            raise FileExistsError(errno.EEXIST, "it already exists", str(place)) from None
        raise


def replace_folder(fresh: Path, place: Path, files_of: FilesOf) -> None:
    """Replace a folder by a new one; at any moment either the old or the new one is complete.

    Parameters
    ----------
    fresh : Path
        The new folder, in the same folder as ``place``.
    place : Path
        Absent, empty, or a folder that may be replaced.
    files_of : callable
        Called before the folder at ``place`` is replaced, and again before its files are deleted.

    Raises
    ------
    InputError
        From ``files_of``; the old folder is kept.
    OSError
        A folder cannot be renamed; the message names the old folder's path if it has changed.
    """
    for _ in range(100):  # [count] Other processes may replace it at the same time
        with suppress(FileExistsError):
            move_in(fresh, place)
            break
        seen = _number(place)
        try:
            files_of(place)
        except InputError:
            if _number(place) == seen:
                raise
            continue  # another process has replaced it meanwhile, and was deleting what was seen
        with suppress(FileNotFoundError):  # another process has just moved it
            _replace(fresh, place, files_of)
            break
    else:
        raise OSError(errno.EBUSY, f"other processes keep writing {place}; try again")
    for former in find_replaced(place):
        with suppress(InputError, OSError):
            _delete(former, files_of(former))


def _number(place: Path) -> int:
    """Return what identifies a folder whatever its name; 0 if there is none."""
    try:
        return place.stat().st_ino
    except OSError:
        return 0


def _replace(fresh: Path, place: Path, files_of: FilesOf) -> None:
    spare = temporary_path(place, "old")
    fresh.rename(spare)
    try:
        _exchange(spare, place)
    except OSError:
        spare.rename(fresh)
        raise
    # checked again: a file of the user's may have been added to the old folder meanwhile
    try:
        files = files_of(spare)
    except BaseException:
        _exchange(spare, place)
        spare.rename(fresh)
        raise
    try:
        _delete(spare, files)
    except KeyboardInterrupt:
        # the new folder is in place: finish deleting the old one before the interrupt goes on
        _delete(spare, files)
        raise


def _delete(folder: Path, files: Collection[Path]) -> None:
    """Delete these files and their empty folders, but no file that was added since."""
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
            f"a file was added to a folder while it was replaced; the file is kept in {folder}",
        ) from None


def _exchange(one: Path, other: Path) -> None:
    """Exchange two folders, in one step where the system and the disk support it."""
    try:  # with two renames alone, a reader or a kill between them would find no folder
        _rename_with(one, other, _EXCHANGE)
        return
    except OSError as error:
        if error.errno not in _UNSUPPORTED:
            raise
    aside = temporary_path(other, "old")
    other.rename(aside)
    try:
        one.rename(other)
    except BaseException as error:
        try:
            aside.rename(other)
        except OSError:
            number = error.errno if isinstance(error, OSError) else errno.EIO
            raise OSError(
                number, f"{other} could not be replaced; the old folder is now {aside}"
            ) from error
        raise
    aside.rename(one)


def rename_new(fresh: Path, path: Path) -> None:
    """Rename a file to an unused name.

    Raises
    ------
    FileExistsError
        The name is already used.
    """
    try:
        _rename_with(fresh, path, _NOREPLACE)
        return
    except OSError as error:
        if error.errno not in _UNSUPPORTED:
            raise
    if os.path.lexists(path):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    fresh.rename(path)


def _rename_with(one: Path, other: Path, flag: int) -> None:
    """Rename with a flag of ``renameat2``; raise OSError ENOSYS where the call is missing."""
    rename = _renameat2()
    if rename is None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))
    if rename(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), flag) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(one), None, str(other))


@cache
def _renameat2() -> Any:
    """Return Linux's ``renameat2``; None elsewhere and with a C library that lacks it."""
    if sys.platform != "linux":
        return None
    found = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if found is not None:
        found.argtypes = [
            *(ctypes.c_int, ctypes.c_char_p),
            *(ctypes.c_int, ctypes.c_char_p, ctypes.c_uint),
        ]
    return found
