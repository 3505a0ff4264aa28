"""A height map as a triangle mesh in binary PLY, for any 3-D viewer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_core.formats.files import write_atomically

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
