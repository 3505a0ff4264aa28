"""Products with matrices whose rows are zero except for a few neighbouring columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32


class BANDED:
    """Size of the blocks of a banded matrix. It affects the time, not the product."""

    # [count] Number of blocks, unless they would be small. Source: measured with images of 480
    # rows of 640 pixels.
    blocks = 12
    # [rows or columns] Smallest size of a block along the longer side of the matrix. Source:
    # measured with 130 nodes; smaller products cost more per number.
    smallest_block = 20


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
    def of(cls, matrix: Array) -> BandedMatrix:
        """Split a matrix (N, n)."""
        blocks, count = [], len(matrix)
        longest = max(matrix.shape)
        block = max(BANDED.smallest_block, longest // BANDED.blocks)
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
