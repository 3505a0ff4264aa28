"""Files of a single array, as ``numpy.save`` writes them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes


def read_npy(path: Path, kind: str) -> NDArray[Any]:
    """Read the array of a ``.npy`` file, without pickles.

    Parameters
    ----------
    path : Path
    kind : {"f", "i"}
        Floating or whole numbers.

    Raises
    ------
    InputError
        The file is missing, damaged, or holds other values than finite numbers of this kind.
    """
    try:
        array = np.load(io.BytesIO(read_bytes(path)), allow_pickle=False)
        numbers = isinstance(array, np.ndarray) and array.dtype.kind == kind
    except (ValueError, EOFError, MemoryError) as error:
        raise InputError(f"{path} is no .npy file of an array; restore it from a copy") from error
    if not numbers or not array.size or not np.isfinite(array).all():
        words = {"f": "finite", "i": "whole"}[kind]
        raise InputError(f"{path} holds other values than {words} numbers; restore it from a copy")
    return np.asarray(array)
