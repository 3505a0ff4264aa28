"""Refinements of the grid, and banded matrices for them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.algorithms.force.elastic_layer import ElasticLayer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_sim.contact_state import Move
from tactile_sim.contact_step import ContactModel, Precision
from tactile_sim.gel import SoftGel
from tactile_sim.indenters import Indenter

# [count] Nodes on the radius of a contact: ``tests/test_gel_surface.py`` checks the result
_NODES_PER_RADIUS = 10
# [ratio] Extra resolution, because a coarse grid measures the radius inaccurately and friction
# changes it slightly
_SAFETY = 1.1
# [ratio] Largest refinement in one pass. A contact that covers few nodes may prove larger on a
# finer grid
_SHRINK: float = 3


def accurate_spacing(
    gel: SoftGel,
    extent_mm: tuple[float, float],
    widest_mm: float,
    indenter: Indenter,
    move: Move,
) -> float:
    """Node spacing that puts ten nodes on the radius of a contact, mm.

    Solves the contact without friction on successively finer grids.

    Parameters
    ----------
    gel : SoftGel
    extent_mm : (width, height)
        Size of the area to solve on.
    widest_mm : float
        Upper bound of the result.
    indenter : Indenter
        Object to press; its finest feature is resolved too.
    move : Move
        Pose and load of the press.
    """
    frictionless = replace(gel, friction=0.0, branches=())
    # [share of the largest overlap] That of the fast mode; the trials have no friction
    precision = Precision(normal=2e-3, friction=1.0, sweeps=1)
    finest = min(max(extent_mm) / 1280, widest_mm)  # [count] bounds memory and time
    spacing = widest_mm
    while True:
        grid = SurfaceGrid.covering(*extent_mm, spacing)
        model = ContactModel(ElasticLayer(grid, gel.elastomer), frictionless, precision)
        above = model.place_object(model.undeformed_state(), indenter, move.pose)
        contact = model.step(above, indenter, move).contact
        radius = np.sqrt(np.count_nonzero(contact) * grid.cell_mm2 / np.pi)
        needed = float(radius) / (_SAFETY * _NODES_PER_RADIUS)
        if indenter.detail_mm is not None:
            needed = min(needed, indenter.detail_mm / 2)  # sampling theorem: two per period
        if spacing <= max(needed, finest):
            return spacing
        spacing = max(needed, finest, spacing / _SHRINK)


@dataclass(frozen=True, eq=False)
class BandedMatrix:
    """An (N, n) matrix as dense blocks of rows, each with the columns that it needs.

    Attributes
    ----------
    blocks : tuple of (rows, columns, part)
        Slices of the matrix, and its part there, float32.
    """

    blocks: tuple[tuple[slice, slice, Float32], ...]

    @classmethod
    def from_matrix(cls, matrix: Array) -> BandedMatrix:
        """Split a matrix (N, n)."""
        blocks, count = [], len(matrix)
        longest = max(matrix.shape)
        # [rows] Smaller products cost more per number, measured with 130 nodes; 12 blocks are
        # fastest for images of 480 rows
        block = max(20, longest // 12)
        size = -(-block * count // longest)
        for start in range(0, count, size):
            rows = slice(start, min(start + size, count))
            used = np.flatnonzero(matrix[rows].any(0))
            columns = slice(int(used[0]), int(used[-1]) + 1) if used.size else slice(0, 1)
            part = np.ascontiguousarray(matrix[rows, columns], np.float32)
            blocks.append((rows, columns, part))
        return cls(tuple(blocks))

    def times(self, field: Float32) -> Float32:
        """(..., N, W) product of the matrix and a field (..., n, W): along the columns."""
        shape = *field.shape[:-2], self.blocks[-1][0].stop, field.shape[-1]
        out = np.empty(shape, np.float32)
        for rows, columns, part in self.blocks:
            np.matmul(part, field[..., columns, :], out=out[..., rows, :])
        return out

    def along(self, field: Float32) -> Float32:
        """(..., H, N) product of a field (..., H, n) and the transposed matrix: along the rows."""
        lines = field.reshape(-1, field.shape[-1])
        out = np.empty((len(lines), self.blocks[-1][0].stop), np.float32)
        for rows, columns, part in self.blocks:
            np.matmul(lines[:, columns], part.T, out=out[:, rows])
        return out.reshape(*field.shape[:-1], -1)
