"""Height maps as TMD files and as PLY meshes."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import MAX_PIXELS, read_bytes, write_atomically

_HEADER = b"Binary TrueMap Data File v2.0\r\n\0"  # First bytes of a file

_SIZES = struct.Struct("<II4f")  # Columns, rows, lengths and offsets

_MAX_COMMENT_BYTES = 4096  # Length of the comment including its NUL, bytes

# Largest pixel size that is written, mm; float32 represents the lengths of such maps.
_MAX_MM_PER_PX = 1e6


@dataclass(frozen=True, eq=False)
class Tmd:
    """Content of a TMD file.

    Attributes
    ----------
    height_mm : (H, W) float32
        Larger is nearer to the camera: a groove in the object is lower, as in
        :class:`~tactile_core.quantities.HeightMap`.
    mm_per_px : float
        To the precision of float32.
    offset_mm : (float, float)
        Position of the first pixel, x and y.
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
        The file is missing, not a TMD v2, truncated or inconsistent.
    """
    path = Path(path)
    data = read_bytes(path)
    if not data.startswith(_HEADER):
        raise InputError(
            f"{path} is not a TMD height map: it does not begin with the TrueMap header"
        )
    end = data.find(b"\0", len(_HEADER), len(_HEADER) + _MAX_COMMENT_BYTES)
    start = end + 1 + _SIZES.size
    if end < 0 or len(data) < start:
        raise InputError(f"{path} is truncated in its header; copy or export it again")
    columns, rows, length_x, length_y, *offset = _SIZES.unpack_from(data, end + 1)
    present = (len(data) - start) // 4
    if columns * rows > present:
        raise InputError(
            f"{path} is truncated: its header gives {columns} × {rows} heights, but it contains "
            f"{present}; copy or export it again"
        )
    if columns * rows < present:
        raise InputError(
            f"{path} is corrupt: its header gives {columns} × {rows} heights, but it contains "
            f"{present}; copy or export it again"
        )
    if present > MAX_PIXELS:
        raise InputError(
            f"{path} has {columns} × {rows} heights, more than the limit of "
            f"{MAX_PIXELS / 1e6:.0f} million; export a part of it"
        )
    lengths = np.array([length_x, length_y, *offset])
    if columns * rows == 0 or not np.isfinite(lengths).all() or not lengths[:2].min() > 0:
        raise InputError(
            f"{path} is corrupt: its header gives {columns} × {rows} heights over {length_x:g} × "
            f"{length_y:g} mm; export it again"
        )
    scale_x, scale_y = length_x / columns, length_y / rows
    if abs(scale_x / scale_y - 1) > 0.01:  # [ratio] rounding
        raise InputError(
            f"{path} has non-square pixels of {scale_x:g} × {scale_y:g} mm; resample it to square "
            f"pixels"
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
    """Write a TMD file atomically.

    Parameters
    ----------
    path : Path
        An existing file is replaced.
    height_mm : (H, W) float32
        Larger is nearer to the camera.
    mm_per_px : float
        Size of a pixel; stored to the precision of float32.
    offset_mm : (float, float)
        Position of the first pixel, x and y.
    comment : str
        Stored in the file; must not contain NUL.

    Raises
    ------
    ValueError
        The format cannot represent the array, the scale or the comment.
    OSError
        The disk is full or not writable.
    """
    if height_mm.ndim != 2 or height_mm.size == 0:
        raise ValueError(f"a TMD needs an (H, W) height map, not shape {height_mm.shape}")
    if not 0 < mm_per_px <= _MAX_MM_PER_PX:
        raise ValueError(f"mm_per_px must be positive and at most {_MAX_MM_PER_PX:g}")
    words = comment.encode("utf-8", "surrogateescape")
    if b"\0" in words or len(words) >= _MAX_COMMENT_BYTES:
        raise ValueError(
            f"a TMD comment must be shorter than {_MAX_COMMENT_BYTES} bytes and contain no NUL"
        )
    rows, columns = height_mm.shape
    sizes = _SIZES.pack(columns, rows, columns * mm_per_px, rows * mm_per_px, *offset_mm)
    heights = np.ascontiguousarray(height_mm, "<f4").tobytes()
    write_atomically(Path(path), b"".join([_HEADER, words, b"\0", sizes, heights]))


# One triangle in the file: the number of its corners and their vertex indices.
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", (3,))])


def write_ply(path: Path, points_mm: NDArray[np.float32]) -> None:
    """Write the gel surface as a mesh, in mm in the sensor frame.

    The origin is the image centre; x points right, y down and z away from the camera, so a height
    is a negative z. Faces are counter-clockwise as seen from the camera.

    Parameters
    ----------
    path : Path
        An existing file is replaced.
    points_mm : (H, W, 3) float32
        :attr:`~tactile_core.quantities.HeightMap.points_mm`. Finite; at least 2 × 2 points.

    Raises
    ------
    ValueError
        The map is too small for a face.
    OSError
        The disk is full or not writable; no partial file remains.
    """
    rows, columns, _ = points_mm.shape
    if min(rows, columns) < 2:
        raise ValueError(f"a mesh needs at least 2 × 2 points, not {rows} × {columns}")
    vertices, faces = points_mm.astype("<f4", copy=False).reshape(-1, 3), _faces(rows, columns)
    header = (
        "ply\n"
        "format binary_little_endian 1.0\n"
        "comment millimetres; x right, y down, z away from the camera\n"
        f"element vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\n"
        "property list uchar int vertex_indices\n"
        "end_header\n"
    )
    write_atomically(path, b"".join([header.encode("ascii"), vertices.tobytes(), faces.tobytes()]))


def _faces(rows: int, columns: int) -> NDArray[np.void]:
    corner = np.arange(rows * columns, dtype="<i4").reshape(rows, columns)
    a, b = corner[:-1, :-1].ravel(), corner[:-1, 1:].ravel()
    c, d = corner[1:, :-1].ravel(), corner[1:, 1:].ravel()
    faces = np.empty((len(a), 2), _FACE)
    faces["count"] = 3
    faces["corners"][:, 0] = np.stack([a, c, b], 1)
    faces["corners"][:, 1] = np.stack([b, c, d], 1)
    return faces.ravel()
