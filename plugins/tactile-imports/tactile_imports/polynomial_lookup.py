"""Taxim's table read backwards: the slope whose change of colour is nearest to the observed one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.importer import Importer
from tactile_core.interfaces.slope_models.model_file import Arrays
from tactile_core.interfaces.slope_models.samples import ImageShape
from tactile_core.quantities import Bool, Float32, Frame, Reference
from tactile_imports.polynomial_table import (
    FULL_SCALE,
    TERMS,
    Float64,
    Order,
    PolynomialTable,
    place_terms,
    read_table,
)
from tactile_imports.slope_image import COLOURS, STEEPEST, SlopeImageModel, colour_shape

if TYPE_CHECKING:
    from scipy.spatial import KDTree

_TILE_PX = 40  # The nearest slopes are sought for the middle of a tile of this side
_NEAREST = 8  # [count] of which the best one at the pixel itself is taken


class PolynomialLookup(SlopeImageModel):
    """The slope whose change of colour in a :class:`PolynomialTable` is nearest.

    A table describes pressed gel, which is brighter than the undeformed surface even where it is
    level. No change is therefore no slope.

    Parameters
    ----------
    table : PolynomialTable
    shape : (H, W, 3)
        Shape of the images that the table was made from: its positions are pixels.
    """

    def __init__(self, table: PolynomialTable, shape: ImageShape) -> None:
        self.table, self.shape = table, shape

    def __getstate__(self) -> dict[str, Any]:
        return {"table": self.table, "shape": self.shape}

    def _slopes(self, frame: Frame, reference: Reference) -> Float32:
        change = frame.pixels - reference.pixels
        change *= FULL_SCALE / frame.full_scale
        slopes = np.empty((2, *self.shape[:2]), np.float32)
        for tile in self._tiles:
            rows, columns = tile.rows, tile.columns
            slopes[:, rows, columns] = np.moveaxis(tile.slopes(change[rows, columns]), 2, 0)
        return slopes

    @cached_property
    def _tiles(self) -> list[_Tile]:
        height, width, _ = self.shape
        kept = _distinct(self.table)
        coefficients, slopes = self.table.coefficients[kept], self.table.slopes()[kept]
        return [
            _Tile(
                slice(top, min(top + _TILE_PX, height)),
                slice(left, min(left + _TILE_PX, width)),
                coefficients,
                slopes,
            )
            for top in range(0, height, _TILE_PX)
            for left in range(0, width, _TILE_PX)
        ]

    def _arrays(self) -> Arrays:
        return {"coefficients": self.table.coefficients}

    @classmethod
    def _from_arrays(cls, arrays: Arrays, shape: ImageShape) -> Self:
        coefficients = np.asarray(arrays["coefficients"], float)
        bins = len(coefficients)
        if bins < 2 or coefficients.shape != (bins, bins, COLOURS, TERMS):
            raise ValueError("the table has another size")
        if not np.isfinite(coefficients).all():
            raise ValueError("a coefficient is not finite")
        return cls(PolynomialTable(coefficients), shape)


@dataclass(frozen=True, eq=False)
class _Tile:
    """A part of the image with the slopes that colours can have there."""

    rows: slice
    columns: slice
    coefficients: Float64  # (N, 3, 6)
    candidates: Float32  # (N, 2)

    def slopes(self, change: NDArray[Any]) -> Float32:
        """Return the slopes (h, w, 2) of changes (h, w, 3)."""
        height, width, _ = change.shape
        y, x = np.mgrid[self.rows, self.columns]
        observed = change.reshape(-1, COLOURS)
        size = np.linalg.norm(observed, axis=1)
        # by the triangle inequality, no change is nearest to all that is smaller
        sought = size >= self._least / 2
        observed, places = observed[sought], place_terms(x, y).reshape(-1, TERMS)[sought]
        ranks = range(1, 1 + min(_NEAREST, len(self.candidates)))
        near = np.asarray(self._tree.query(observed, k=ranks)[1])
        expected = np.einsum("nkct,nt->nkc", self.coefficients[near], places)
        distance = np.linalg.norm(expected - observed[:, None], axis=2)
        best = near[np.arange(len(near)), distance.argmin(axis=1)]
        pressed = distance.min(axis=1) < size[sought]
        found = np.zeros((height * width, 2), np.float32)
        found[sought] = np.where(pressed[:, None], self.candidates[best], 0)
        return found.reshape(height, width, 2)

    @cached_property
    def _tree(self) -> KDTree:
        from scipy.spatial import KDTree  # heavy

        middle = ((part.start + part.stop - 1) / 2 for part in (self.columns, self.rows))
        return KDTree(self.coefficients @ place_terms(*middle))

    @cached_property
    def _least(self) -> float:
        return float(np.linalg.norm(self._tree.data, axis=1).min())


def _distinct(table: PolynomialTable) -> Bool:
    """Return (B, B) bool: the bins to choose from.

    Taxim fills bins that no press has shown with the nearest that one has. Of equal ones, the least
    tilted is the one that was seen.
    """
    kept = np.hypot(*np.moveaxis(table.slopes(), 2, 0)) <= STEEPEST
    kept[1:] &= ~np.isclose(table.coefficients[1:], table.coefficients[:-1]).all(axis=(2, 3))
    return np.asarray(kept)


class TaximImporter(Importer):
    """Reads ``polycalib.npz`` with the channels in Taxim's own order: ``grad_r`` is blue."""

    order: ClassVar[Order] = "bgr"

    def read(self, path: Path, build: SensorBuild) -> PolynomialLookup:
        """Return the table in the file; see :meth:`Importer.read`."""
        return PolynomialLookup(read_table(path, self.order), colour_shape(build))


class TaximRgbImporter(TaximImporter):
    """Reads ``polycalib.npz`` with the channels in Isaac Lab's order: ``grad_r`` is red."""

    order = "rgb"
