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

# Largest array, bytes; more than three float32 values for each pixel of the largest image.
MAX_ARRAY_BYTES = 1 << 30


def write_npz(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write named arrays atomically.

    Raises
    ------
    ValueError
        An array contains Python objects, which would need a pickle.
    OSError
        The disk is full or not writable.
    """
    write_atomically(path, npz_bytes(arrays, str(path)))


def npz_bytes(arrays: Mapping[str, ArrayLike], where: str) -> memoryview:
    """Return the content of an ``.npz`` file with named arrays.

    Parameters
    ----------
    arrays : mapping of str to array
    where : str
        Where it will be, in messages.

    Raises
    ------
    ValueError
        An array contains Python objects, which would need a pickle.
    """
    plain = {name: np.asarray(array) for name, array in arrays.items()}
    for name, array in plain.items():
        if array.dtype.hasobject:
            raise ValueError(f"{name!r} contains Python objects and cannot be saved in {where}")
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in plain.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, array, allow_pickle=False)
    return buffer.getbuffer()


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Read every array of an ``.npz`` file.

    Raises
    ------
    InputError
        The file is missing, corrupt, or contains Python objects instead of arrays.
    """
    path = Path(path)
    return npz_arrays(read_bytes(path), str(path))


def npz_arrays(data: bytes, where: str) -> dict[str, NDArray[Any]]:
    """Return every array in the content of an ``.npz`` file.

    Parameters
    ----------
    data : bytes
    where : str
        Where it comes from, in messages.

    Raises
    ------
    InputError
        It is corrupt, or contains Python objects instead of arrays.
    """
    if not data.startswith(b"PK"):
        raise InputError(f"{where} is not an .npz file; write it again or restore it from a copy")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for entry in archive.infolist():
                _check(archive, entry)
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except Exception as error:  # numpy and zipfile raise almost anything on damaged bytes
        raise InputError(
            f"{where} is corrupt or contains other values than arrays ({_first_line(error)}); "
            f"write it again or restore it from a copy"
        ) from error


def _check(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
    """Reject an array whose header claims more memory than the entry stores."""
    if entry.file_size > MAX_ARRAY_BYTES:
        raise ValueError(f"{printable(entry.filename)} has {entry.file_size / 1e9:.3g} GB")
    with archive.open(entry) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0
        shape, _, dtype = (read if version == (1, 0) else np.lib.format.read_array_header_2_0)(file)
        stored = entry.file_size - file.tell()
    if not dtype.hasobject and math.prod(shape) * dtype.itemsize != stored:
        raise ValueError(f"the size of {printable(entry.filename)} contradicts its header")


def _first_line(error: Exception) -> str:
    return printable(str(error).splitlines()[0] if str(error) else type(error).__name__)
