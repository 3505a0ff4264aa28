"""Displacement of a bonded elastic layer under a contact in shear, torsion and expansion.

The displacement bends sharply at the border of a contact, because there is no traction outside it.
Markers are too sparse to resolve that bend. Elasticity predicts it from the contact area.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32, Float64
from tactile_core.algorithms.displacement.coarse_grid import CoarseGrid
from tactile_core.algorithms.displacement.layer_response import LayerResponse
from tactile_core.algorithms.elasticity import Elastomer


class CONTACT_SHEAR:
    """Parameters of the elastic fields of a contact."""

    # [gel thicknesses] Margin of the periodic grid around the image. Source: by hand, a bonded
    # layer decays within about one thickness.
    margin_thicknesses = 0.75
    # [cells] Added to the distance from the border, so that the singular traction stays finite.
    # Source: by hand, less than one cell.
    blunting_cells = 0.7
    # [cells] A smaller contact has no border that the grid resolves. Source: by hand, a square of
    # two cells.
    min_contact_cells = 4.0


@dataclass(frozen=True, eq=False)
class ElasticFields:
    """The displacement fields of one contact: shear in x and y, torsion and expansion.

    Attributes
    ----------
    planes : (7, rows, columns) float32
        From :class:`LayerResponse`.
    x_mm : (columns,) float32
    y_mm : (rows,) float32
        Positions of the nodes, relative to the centroid of the traction.
    """

    planes: Float32
    x_mm: Float32
    y_mm: Float32

    def beside(self, moved_mm: Float64, grid: CoarseGrid, points: Float32) -> Float64:
        """Return the fields at points (N, 2) in cells, and other displacements (N, 2) there.

        Returns
        -------
        (N, 10) float64
            x and y of each field, up to a factor of the field, and of the displacement.
        """
        xx, yy, turned_y, spread_x, xy, turned_x, spread_y = grid.sampled(self.planes, points)
        x, y = (
            side[0] + (side[1] - side[0]) * place
            for side, place in zip((self.x_mm, self.y_mm), points.T, strict=True)
        )
        turned = x * xy - y * xx + turned_x, x * yy - y * xy + turned_y
        spread = x * xx + y * xy + spread_x, x * xy + y * yy + spread_y
        rows = np.array([xx, xy, xy, yy, *turned, *spread, *moved_mm.T], np.float64)
        return np.ascontiguousarray(rows.T)

    def total(self, strength: Float64) -> Float32:
        """Return the sum (2, rows, columns) of the fields, each times its strength."""
        xx, yy, _, _, xy, _, _ = self.planes
        right, down, turn, spread = strength.tolist()
        uniform = [[right, 0, 0, spread, down, turn, 0], [0, down, turn, 0, right, 0, spread]]
        planes = self.planes.reshape(len(self.planes), -1)
        total = (np.array(uniform, np.float32) @ planes).reshape(2, *xx.shape)
        # the factors that grow with the distance from the centroid
        turn, spread = np.float32(turn), np.float32(spread)
        x, y = self.x_mm, self.y_mm[:, None]
        along_x, along_y = spread * x - turn * y, turn * x + spread * y
        total[0] += along_x * xx
        total[0] += along_y * xy
        total[1] += along_x * xy
        total[1] += along_y * yy
        return total


class ContactShear:
    """Displacement fields of a layer under a contact: shear in x and y, torsion and expansion.

    The traction grows towards the border of the contact as 1/√distance, as under a rigid object
    that sticks [1]_.

    Parameters
    ----------
    grid : CoarseGrid
    mm_per_px : float
        Scale of the image.
    elastomer : Elastomer
        The fields depend on its thickness and Poisson's ratio, not on its modulus.

    References
    ----------
    .. [1] K. L. Johnson, "Contact Mechanics", Cambridge University Press, 1985.
    """

    def __init__(
        self,
        grid: CoarseGrid,
        *,
        mm_per_px: float,
        elastomer: Elastomer,
    ) -> None:
        width_mm, height_mm = mm_per_px * grid.cell_px
        margin_mm = CONTACT_SHEAR.margin_thicknesses * elastomer.thickness_mm
        margins = (int(np.ceil(margin_mm / side)) for side in (height_mm, width_mm))
        self._margin = top, left = tuple(margins)
        rows, columns = grid.shape
        # both even
        self._shape = rows + rows % 2 + 2 * top, columns + columns % 2 + 2 * left
        inside = slice(top, top + rows), slice(left, left + columns)
        cell_mm = float(width_mm), float(height_mm)
        self._layer = LayerResponse(self._shape, inside, cell_mm=cell_mm, elastomer=elastomer)
        self._x_mm, self._y_mm = (
            (side * (np.arange(count) - first)).astype(np.float32)
            for side, count, first in zip(
                cell_mm, self._shape[::-1], self._margin[::-1], strict=True
            )
        )

    def fields(self, contact: Float32) -> ElasticFields | None:
        """Return the displacement fields of a contact.

        Parameters
        ----------
        contact : (rows, columns) float32
            Share of each cell that is in contact.

        Returns
        -------
        ElasticFields or None
            None for a contact of less than four cells.
        """
        if contact.sum() < CONTACT_SHEAR.min_contact_cells:
            return None
        traction, x_mm, y_mm = self._traction(contact)
        (rows, columns), (top, left) = contact.shape, self._margin
        return ElasticFields(
            self._layer.displaced(traction),
            self._x_mm[left : left + columns] - x_mm,
            self._y_mm[top : top + rows] - y_mm,
        )

    def _traction(self, contact: Float32) -> tuple[Float32, np.float32, np.float32]:
        """Traction on the padded grid, and x and y of its centroid, mm.

        The contact continues beyond the image.
        """
        (top, left), (rows, columns) = self._margin, self._shape
        bottom, right = rows - top - contact.shape[0], columns - left - contact.shape[1]
        wide = cv2.copyMakeBorder(contact, top, bottom, left, right, cv2.BORDER_REPLICATE)
        inside = np.asarray(wide > 0.5).view(np.uint8)
        depth = cv2.distanceTransform(inside, cv2.DIST_L2, cv2.DIST_MASK_5)
        blunting = CONTACT_SHEAR.blunting_cells
        traction = np.asarray(wide / np.sqrt(depth + np.float32(blunting)), np.float32)
        along_x, along_y = traction.sum(0), traction.sum(1)
        total = along_x.sum()
        return traction, along_x @ self._x_mm / total, along_y @ self._y_mm / total
