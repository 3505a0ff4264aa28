"""Shear of a contact, and the response of the layer around it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Complex64, Float32, Float64
from tactile_core.algorithms.displacement.kriging import CoarseGrid
from tactile_core.algorithms.force.elastic_layer import Elastomer

# Components that are even functions along y, which come first, and all components.
EVEN, COMPONENTS = 4, 7


class LayerResponse:
    """Displacements of a layer under one traction: uniform, and proportional to the position.

    The components are, with the displacement G_ij along i at the offset Δ from a unit traction
    along j::

        G_xx, G_yy, Δy G_xy − Δx G_yy, −Δx G_xx − Δy G_xy, G_xy, Δy G_xx − Δx G_xy,
        −Δx G_xy − Δy G_yy

    each convolved with the traction t. With them x G ∗ t − (Δx G) ∗ t is the displacement under the
    traction x t, and likewise with y, so that one transform of t is enough.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns of the traction, both even. The grid is periodic.
    inside : (slice, slice)
        Nodes at which the displacement is computed.
    cell_mm : (float, float)
        Width and height of a cell.
    elastomer : Elastomer
        The result depends on its thickness and Poisson's ratio, not on its modulus.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        inside: tuple[slice, slice],
        *,
        cell_mm: tuple[float, float],
        elastomer: Elastomer,
    ) -> None:
        rows, columns = shape
        self._response = _response(shape, cell_mm, elastomer)
        # along y waves are real, cosines and sines, and along x complex
        to_y, to_x = (_waves(count) for count in shape)
        self._from_rows = np.ascontiguousarray(to_y.reshape(-1, rows), np.float32)
        complex_x = np.stack([to_x[0], -to_x[1]], axis=1).reshape(-1, columns)
        self._from_columns = np.ascontiguousarray(complex_x.T, np.float32)
        to_y, to_x = (_weight_waves(side) for side in (to_y, to_x))
        to_rows = to_y.reshape(-1, rows).T[inside[0]]
        to_columns = np.stack([to_x[0], -to_x[1]], axis=1).reshape(-1, columns)[:, inside[1]]
        self._to_rows = np.ascontiguousarray(to_rows, np.float32)
        self._to_columns = np.ascontiguousarray(to_columns, np.float32)
        # kept, because new memory of this size is costly
        self._spectra = np.empty(self._response.shape, np.complex64)

    def apply_traction(self, traction: Float32) -> Float32:
        """Return the components inside, (7, rows, columns), for a traction on the whole grid."""
        spectrum = (self._from_rows @ traction @ self._from_columns).view(np.complex64)
        spectrum = spectrum.reshape(2, -1, spectrum.shape[1])
        np.multiply(self._response[:EVEN], spectrum, out=self._spectra[:EVEN])
        # an odd function along y exchanges cosines and sines
        np.multiply(self._response[EVEN:], spectrum[::-1], out=self._spectra[EVEN:])
        waves = self._spectra.view(np.float32).reshape(COMPONENTS, -1, self._to_columns.shape[0])
        return np.asarray(self._to_rows @ waves @ self._to_columns)


def _waves(count: int) -> Float64:
    """Cosines and sines (2, count / 2 + 1, count) of a periodic line."""
    phase = 2 * np.pi / count * np.arange(count // 2 + 1)[:, None] * np.arange(count)
    return np.stack([np.cos(phase), np.sin(phase)])


def _weight_waves(waves: Float64) -> Float64:
    """Scale waves so that they add up to the values of which they are the transform."""
    weight = np.full((waves.shape[1], 1), 2.0)
    weight[0] = weight[-1] = 1.0
    return np.asarray(waves * weight / waves.shape[2])


def _response(
    shape: tuple[int, int], cell_mm: tuple[float, float], elastomer: Elastomer
) -> Complex64:
    """Response (7, 2, ky, kx) of each component to cosines and sines along y."""
    (rows, columns), (width_mm, height_mm) = shape, cell_mm
    kx = 2 * np.pi * np.fft.rfftfreq(columns, width_mm)[None, :]
    ky = 2 * np.pi * np.fft.fftfreq(rows, height_mm)[:, None]
    k = np.hypot(kx, ky)
    cos, sin = (np.divide(side, k, out=np.zeros_like(k), where=k > 0) for side in (kx, ky))
    found = elastomer.compliance(k)
    along, across = (part / found.across[0, 0] for part in (found.along, found.across))
    xx, yy = along * cos**2 + across * sin**2, along * sin**2 + across * cos**2
    xx[0, 0] = yy[0, 0] = 1.0
    xy = (along - across) * cos * sin
    xy[rows // 2] = xy[:, -1] = 0.0
    g_xx, g_xy, g_yy = (np.fft.irfft2(part, s=shape) for part in (xx, xy, yy))
    x, y = width_mm * _offsets(columns), height_mm * _offsets(rows)[:, None]
    turned = y * g_xy - x * g_yy, y * g_xx - x * g_xy
    spread = -x * g_xx - y * g_xy, -x * g_xy - y * g_yy
    even, odd = (
        np.fft.rfft2(np.stack(parts))[:, : rows // 2 + 1]
        for parts in ((g_xx, g_yy, turned[0], spread[0]), (g_xy, turned[1], spread[1]))
    )
    parts = np.stack([even, even], axis=1), np.stack([-1j * odd, 1j * odd], axis=1)
    return np.concatenate(parts).astype(np.complex64)


def _offsets(count: int) -> Float64:
    """Offsets (count,) of the nodes of a periodic line from the first one; 0 halfway round."""
    offsets = np.fft.fftfreq(count, 1 / count)
    offsets[count // 2] = 0.0
    return np.asarray(offsets)


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
        xx, yy, turned_y, spread_x, xy, turned_x, spread_y = grid.sample_planes(self.planes, points)
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


class ElasticShear:
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
        # [thicknesses] A bonded layer decays within about one
        margin_mm = 0.75 * elastomer.thickness_mm
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
        if contact.sum() < 4.0:  # [cells] the grid resolves no border
            return None
        traction, x_mm, y_mm = self._traction(contact)
        (rows, columns), (top, left) = contact.shape, self._margin
        return ElasticFields(
            self._layer.apply_traction(traction),
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
        blunting = 0.7  # [cells] the singular traction at the border stays finite
        traction = np.asarray(wide / np.sqrt(depth + np.float32(blunting)), np.float32)
        along_x, along_y = traction.sum(0), traction.sum(1)
        total = along_x.sum()
        return traction, along_x @ self._x_mm / total, along_y @ self._y_mm / total
