"""Named arrays in one ``.npz`` file, without pickles."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes, write_atomically


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
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except Exception as error:  # numpy and zipfile raise almost anything at damaged bytes
        raise InputError(
            f"{path} is corrupt or holds something else than arrays ({error}); write it again or "
            f"restore it from a copy"
        ) from error
