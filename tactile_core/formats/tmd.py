"""GelSight's TMD height maps (TrueMap v2), read and written.

Layout, little-endian: a 32-byte header, a comment ended by NUL, columns and rows (uint32), lengths
along x and y and offsets along x and y in mm (float32), then the heights in mm, row by row.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes, write_atomically
from tactile_core.formats.headers import MOST_PIXELS

_HEADER = b"Binary TrueMap Data File v2.0\r\n\0"
_SIZES = struct.Struct("<II4f")
_LONGEST_COMMENT = 4096
_SQUARENESS = 0.01


@dataclass(frozen=True, eq=False)
class Tmd:
    """A height map as a TMD file holds it.

    Attributes
    ----------
    height_mm : (H, W) float32
        Larger is nearer to the camera: a groove in the object is lower, as in
        :class:`~tactile_core.quantities.HeightMap`.
    mm_per_px : float
        To the precision of float32.
    offset_mm : (float, float)
        Where the first pixel lies, along x and y.
    comment : str
    """

    height_mm: NDArray[np.float32]
    mm_per_px: float
    offset_mm: tuple[float, float] = (0.0, 0.0)
    comment: str = ""


def read_tmd(path: Path) -> Tmd:
    """Read a TMD file.

    Raises
    ------
    InputError
        The file is missing, is no TMD v2, is truncated or contradicts itself.
    """
    path = Path(path)
    data = read_bytes(path)
    if not data.startswith(_HEADER):
        raise InputError(f"{path} is no TMD height map: it does not begin with the TrueMap header")
    end = data.find(b"\0", len(_HEADER), len(_HEADER) + _LONGEST_COMMENT)
    start = end + 1 + _SIZES.size
    if end < 0 or len(data) < start:
        raise InputError(f"{path} is truncated in its header; copy or export it again")
    columns, rows, length_x, length_y, *offset = _SIZES.unpack_from(data, end + 1)
    held = (len(data) - start) // 4
    if columns * rows > held:
        raise InputError(
            f"{path} is truncated: it promises {columns} × {rows} heights and holds {held}; copy "
            f"or export it again"
        )
    if columns * rows < held:
        raise InputError(
            f"{path} is corrupt: it promises {columns} × {rows} heights and holds {held}; copy or "
            f"export it again"
        )
    if held > MOST_PIXELS:
        raise InputError(
            f"{path} has {columns} × {rows} heights, more than the {MOST_PIXELS / 1e6:.0f} million "
            f"that are read; export a part of it"
        )
    lengths = np.array([length_x, length_y, *offset])
    if columns * rows == 0 or not np.isfinite(lengths).all() or not lengths[:2].min() > 0:
        raise InputError(
            f"{path} is corrupt: it says {columns} × {rows} heights over {length_x:g} × "
            f"{length_y:g} mm; export it again"
        )
    scale_x, scale_y = length_x / columns, length_y / rows
    if abs(scale_x / scale_y - 1) > _SQUARENESS:
        raise InputError(
            f"{path} has oblong pixels, {scale_x:g} × {scale_y:g} mm; resample it to square ones"
        )
    heights = np.frombuffer(data, "<f4", columns * rows, start).reshape(rows, columns)
    comment = data[len(_HEADER) : end].decode("utf-8", "surrogateescape")
    return Tmd(heights.astype(np.float32), scale_x, (offset[0], offset[1]), comment)


def write_tmd(
    path: Path,
    height_mm: NDArray[np.float32],
    mm_per_px: float,
    *,
    offset_mm: tuple[float, float] = (0.0, 0.0),
    comment: str = "",
) -> None:
    """Write a TMD file, whole or not at all.

    Parameters
    ----------
    path : Path
        The file; it is replaced when it exists.
    height_mm : (H, W) float32
        Larger is nearer to the camera.
    mm_per_px : float
        Size of a pixel; stored to the precision of float32.
    offset_mm : (float, float)
        Where the first pixel lies, along x and y.
    comment : str
        Kept in the file; without NUL.

    Raises
    ------
    ValueError
        The arrays or the comment cannot be told in this format.
    OSError
        The disk is full or refuses.
    """
    if height_mm.ndim != 2 or height_mm.size == 0:
        raise ValueError(f"a TMD holds an (H, W) height map, not shape {height_mm.shape}")
    if not mm_per_px > 0:
        raise ValueError(f"mm_per_px must be positive, not {mm_per_px}")
    words = comment.encode("utf-8", "surrogateescape")
    if b"\0" in words or len(words) >= _LONGEST_COMMENT:
        raise ValueError(f"a TMD comment is shorter than {_LONGEST_COMMENT} bytes and has no NUL")
    rows, columns = height_mm.shape
    sizes = _SIZES.pack(columns, rows, columns * mm_per_px, rows * mm_per_px, *offset_mm)
    heights = np.ascontiguousarray(height_mm, "<f4").tobytes()
    write_atomically(Path(path), b"".join([_HEADER, words, b"\0", sizes, heights]))
