"""Named arrays in one ``.npz`` file, without pickles."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes, write_atomically
from tactile_core.formats.printable import printable

MOST_ARRAY_BYTES = 1 << 30
"""Of one array: twice as much as three of them for each pixel of the largest image."""


def write_npz(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write named arrays, whole or not at all.

    Raises
    ------
    ValueError
        An array holds Python objects, which would need a pickle.
    OSError
        The disk is full or refuses.
    """
    plain = {name: np.asarray(array) for name, array in arrays.items()}
    for name, array in plain.items():
        if array.dtype.hasobject:
            raise ValueError(f"{name!r} holds Python objects and cannot go into {path}")
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in plain.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, array, allow_pickle=False)
    write_atomically(path, buffer.getbuffer())


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Read every array of an ``.npz`` file.

    Raises
    ------
    InputError
        The file is missing, corrupt, or holds Python objects instead of arrays.
    """
    path = Path(path)
    data = read_bytes(path)
    if not data.startswith(b"PK"):
        raise InputError(f"{path} is no .npz file; write it again or restore it from a copy")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for entry in archive.infolist():
                _check(archive, entry)
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except Exception as error:  # numpy and zipfile raise almost anything at damaged bytes
        raise InputError(
            f"{path} is corrupt or holds something else than arrays ({_words(error)}); write it "
            f"again or restore it from a copy"
        ) from error


def _check(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
    """Refuse an array that would take more memory than what is stored of it."""
    if entry.file_size > MOST_ARRAY_BYTES:
        raise ValueError(f"{printable(entry.filename)} has {entry.file_size / 1e9:.3g} GB")
    with archive.open(entry) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0
        shape, _, dtype = (read if version == (1, 0) else np.lib.format.read_array_header_2_0)(file)
        stored = entry.file_size - file.tell()
    if not dtype.hasobject and math.prod(shape) * dtype.itemsize != stored:
        raise ValueError(f"{printable(entry.filename)} is not of the size that it says")


def _words(error: Exception) -> str:
    return printable(str(error).splitlines()[0] if str(error) else type(error).__name__)
