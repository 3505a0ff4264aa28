"""Unit normals as a 16-bit RGB PNG: (n + 1) / 2, x right, y down, +z towards the viewer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.images import read_image, write_png

_TOP = 65535
_SHORTEST = 0.5


def write_normals(path: Path, normals: NDArray[np.float32]) -> None:
    """Write unit normals.

    Parameters
    ----------
    path : Path
        The file; it is replaced when it exists.
    normals : (H, W, 3) float32
        As :attr:`tactile_core.quantities.Gradients.normals` gives them; red, green and blue are
        x, y and z.

    Raises
    ------
    OSError
        The disk is full or refuses; nothing half-written is left.
    """
    codes = np.rint((np.clip(normals, -1, 1) + 1) * (_TOP / 2)).astype(np.uint16)
    write_png(path, codes)


def read_normals(path: Path) -> NDArray[np.float32]:
    """Read unit normals, exact to 2e-5.

    Returns
    -------
    (H, W, 3) float32
        Of length 1.

    Raises
    ------
    InputError
        The file is no 16-bit RGB picture, or shows something else than unit normals.
    """
    codes = read_image(path)
    if codes.ndim != 3 or codes.dtype != np.uint16:
        raise InputError(f"{path} is no 16-bit RGB picture, so it holds no normals")
    normals = codes.astype(np.float32) * np.float32(2 / _TOP) - 1
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    if length.min() < _SHORTEST:
        raise InputError(f"{path} shows something else than unit normals")
    return np.asarray(normals / length, np.float32)
