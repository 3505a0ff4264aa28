"""Unit normals as a 16-bit RGB PNG: (n + 1) / 2, x right, y down, +z towards the viewer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.images import read_image, write_png

_TOP = 65535  # Largest 16-bit value

_MIN_LENGTH = 0.5  # A shorter vector is not a unit normal


def write_normals(path: Path, normals: NDArray[np.float32]) -> None:
    """Write unit normals.

    Parameters
    ----------
    path : Path
        An existing file is replaced.
    normals : (H, W, 3) float32
        As in :attr:`tactile_core.quantities.Gradients.normals`; red, green and blue are x, y
        and z.

    Raises
    ------
    OSError
        The disk is full or not writable; no partial file remains.
    """
    codes = np.rint((np.clip(normals, -1, 1) + 1) * (_TOP / 2)).astype(np.uint16)
    write_png(path, codes)


def read_normals(path: Path) -> NDArray[np.float32]:
    """Read unit normals, accurate to 2e-5.

    Returns
    -------
    (H, W, 3) float32
        Normalised to length 1.

    Raises
    ------
    InputError
        The file is not a 16-bit RGB image, or its values are not unit normals.
    """
    codes = read_image(path)
    if codes.ndim != 3 or codes.dtype != np.uint16:
        raise InputError(f"{path} is not a 16-bit RGB image, so it contains no normals")
    normals = codes.astype(np.float32) * np.float32(2 / _TOP) - 1
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    if length.min() < _MIN_LENGTH:
        raise InputError(f"{path} contains values that are not unit normals")
    return np.asarray(normals / length, np.float32)
