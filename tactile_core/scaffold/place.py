"""Where something new may be written."""

from __future__ import annotations

import os
from pathlib import Path

from tactile_core.errors import InputError


def refuse_existing(path: Path, *, force: bool, folder: bool = False) -> None:
    """Refuse to write over what somebody has already.

    Parameters
    ----------
    path : Path
    force : bool
        A file may be replaced by a file; in a folder, files of the same names.
    folder : bool
        Whether a folder is to be written.

    Raises
    ------
    InputError
        Something is there, and not ``force`` or of the other kind.
    """
    if not os.path.lexists(path):
        place = Path(os.path.realpath(path))
        if os.path.lexists(place):  # as soon as the folders to it are made
            raise InputError(f"{path} leads through a folder that is not there; give {place}")
        return
    alike = path.is_dir() if folder else path.is_file()
    if not alike:
        raise InputError(
            f"{path} is {'no folder' if folder else 'no file'}; give another --out, the "
            f"{'folder' if folder else 'file'} to write"
        )
    if not force:
        raise InputError(f"{path} exists already; give another --out, or --force to replace it")
