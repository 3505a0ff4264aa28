"""Protection of existing files."""

from __future__ import annotations

import os
from pathlib import Path

from tactile_core.errors import InputError


def refuse_existing(path: Path, *, force: bool, folder: bool = False) -> None:
    """Refuse a path that exists already.

    Parameters
    ----------
    path : Path
    force : bool
        True allows to replace a file by a file, and files of the same names in a folder.
    folder : bool
        True if a folder is to be written.

    Raises
    ------
    InputError
        The path exists without ``force``, is of the other kind, or leads through a missing folder.
    """
    if not os.path.lexists(path):
        place = Path(os.path.realpath(path))
        if os.path.lexists(place):  # once the missing folders have been created
            raise InputError(f"{path} leads through a folder that is not there; give {place}")
        return
    same_kind = path.is_dir() if folder else path.is_file()
    if not same_kind:
        raise InputError(
            f"{path} is {'no folder' if folder else 'no file'}; give another --out, the "
            f"{'folder' if folder else 'file'} to write"
        )
    if not force:
        raise InputError(f"{path} exists already; give another --out, or --force to replace it")
