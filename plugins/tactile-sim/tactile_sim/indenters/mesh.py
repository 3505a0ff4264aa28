"""Objects from meshes and height maps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array
from tactile_core.errors import InputError
from tactile_sim.indenters.solids import FAR_MM, Indenter, positive


@dataclass(frozen=True, eq=False)
class HeightMapIndenter(Indenter):
    """Object whose lower side is a height map; its middle is the object's origin.

    Parameters
    ----------
    height_mm : (H, W)
        Protrusion of each point towards the gel: the highest point makes contact first. NaN
        outside the object. Interpolation between points is bilinear.
    mm_per_px : float
        Spacing of the points.
    """

    height_mm: Array
    mm_per_px: float

    def __post_init__(self) -> None:
        try:
            height = np.array(self.height_mm, np.float64)
        except (TypeError, ValueError):
            raise InputError("a height map should be rows of numbers of equal length") from None
        if height.ndim != 2 or min(height.shape) < 2:
            raise InputError(
                f"a height map should have two dimensions of 2 or more points, not {height.shape}"
            )
        if not np.isfinite(height).any() or np.isinf(height).any():
            raise InputError("a height map should have finite heights, or nan outside the object")
        positive("a height map's mm_per_px", self.mm_per_px)
        height.flags.writeable = False
        object.__setattr__(self, "height_mm", height)

    @property
    def detail_mm(self) -> float | None:
        """Shortest wavelength that the points can represent."""
        return 2 * self.mm_per_px

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        from scipy.ndimage import map_coordinates

        height = self.height_mm
        rows, columns = height.shape
        gap = np.where(np.isnan(height), FAR_MM, np.nanmax(height) - height)
        column = np.asarray(x_mm) / self.mm_per_px + (columns - 1) / 2
        row = np.asarray(y_mm) / self.mm_per_px + (rows - 1) / 2
        values = map_coordinates(gap, [row, column], order=1, cval=FAR_MM, prefilter=False)
        return np.asarray(values)


def mesh_indenter(
    path: str | Path, *, scale: float = 1.0, mm_per_px: float = 0.05
) -> HeightMapIndenter:
    """Read a closed mesh and return its lower side as a height map.

    Parameters
    ----------
    path : str or Path
        STL, OBJ, PLY or any other format that trimesh reads, in millimetres. The side towards −z
        is pressed into the gel; x is right and y down. The middle of the bounding box is the
        object's origin.
    scale : float
        Factor on every length, e.g. 1000 for a mesh in metres.
    mm_per_px : float
        Spacing of the height map's points.

    Raises
    ------
    InputError
        trimesh is not installed, the file cannot be read, or the mesh is not closed.
    """
    positive("a mesh's scale", scale)
    positive("a mesh's mm_per_px", mm_per_px)
    if not isinstance(path, str | Path):
        raise InputError(f"a mesh's path must be a file's name, not {path!r}")
    vertices, faces = _read(Path(path))
    return HeightMapIndenter(_lower_side(scale * vertices, faces, mm_per_px), mm_per_px)


def _read(path: Path) -> tuple[Array, NDArray[np.int64]]:
    try:
        import trimesh
    except ImportError:
        raise InputError(
            "a mesh file needs trimesh; install it with: pip install 'tactile-sim[mesh]'"
        ) from None
    if not path.is_file():
        raise InputError(f"{path} is not a file; give a mesh, for example an STL")
    log = trimesh.util.log  # the InputError reports the same problem in one line
    silent, log.disabled = log.disabled, True
    try:
        mesh: Any = trimesh.load(path, force="mesh")
    except Exception as error:  # trimesh's readers raise whatever their parsers do
        raise InputError(f"{path} cannot be read as a mesh: {error}") from error
    finally:
        log.disabled = silent
    if not len(mesh.faces):
        raise InputError(f"{path} has no faces; give a closed mesh")
    if not mesh.is_watertight:
        raise InputError(f"{path} is not a closed mesh; close its holes, then press it")
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)


def _lower_side(vertices: Array, faces: NDArray[np.int64], mm_per_px: float) -> Array:
    """(H, W) protrusion towards −z on a grid centred on the bounding box; nan outside."""
    low, high = vertices[:, :2].min(0), vertices[:, :2].max(0)
    columns, rows = np.maximum(np.ceil((high - low) / mm_per_px).astype(int) + 1, 2)
    if rows * columns > 4_000_000:  # [points] bounds memory
        raise InputError(
            f"a mesh of {high[0] - low[0]:.4g} × {high[1] - low[1]:.4g} mm is too large for points "
            f"{mm_per_px:g} mm apart; give a larger mm_per_px, or a scale if it is not in mm"
        )
    first = (low + high) / 2 - (np.array([columns, rows]) - 1) / 2 * mm_per_px
    lowest = np.full((rows, columns), np.inf)
    corners = vertices[faces]
    corners[..., :2] = (corners[..., :2] - first) / mm_per_px
    for a, b, c in corners:
        _draw(lowest, a, b, c)
    return np.where(np.isinf(lowest), np.nan, -lowest)


def _draw(lowest: Array, a: Array, b: Array, c: Array) -> None:
    """Rasterise a triangle of corners (column, row, z); keep the lower z at each point."""
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if area == 0:
        return  # vertical: adjacent triangles cover its edges
    x0, x1 = _span(a[0], b[0], c[0], lowest.shape[1])
    y0, y1 = _span(a[1], b[1], c[1], lowest.shape[0])
    x, y = np.arange(x0, x1), np.arange(y0, y1)[:, None]
    second = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
    third = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
    slack = -1e-9  # [barycentric share] Rounding opens no gap between triangles that share an edge
    inside = (second >= slack) & (third >= slack) & (second + third <= 1 - slack)
    z = a[2] + second * (b[2] - a[2]) + third * (c[2] - a[2])
    part = lowest[y0:y1, x0:x1]
    part[inside] = np.minimum(part, z)[inside]


def _span(a: float, b: float, c: float, size: int) -> tuple[int, int]:
    low, high = min(a, b, c), max(a, b, c)
    return max(int(np.floor(low)), 0), min(int(np.ceil(high)) + 1, size)
