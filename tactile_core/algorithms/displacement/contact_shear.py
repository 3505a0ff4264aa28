"""Displacement of a bonded elastic layer under a contact in shear, torsion and expansion.

The displacement bends sharply at the border of a contact, because there is no traction outside it.
Markers are too sparse to resolve that bend. Elasticity predicts it from the contact area.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Complex64, Float32
from tactile_core.algorithms.displacement.coarse_grid import CoarseGrid
from tactile_core.algorithms.elasticity import Elastomer

_COMPONENTS = 0, 1, 1, 2, 3, 4, 5, 6
"""Which of the seven computed components are x and y of each field; two fields share one."""


class ContactShearParameters(NamedTuple):
    """Parameters of the elastic fields of a contact.

    Attributes
    ----------
    margin_thicknesses : float, gel thicknesses
        Margin of the periodic grid around the image.
        Source: chosen by hand; a bonded layer decays within about one thickness.
    blunting_cells : float, cells
        Added to the distance from the border, so that the singular traction stays finite.
        Source: chosen by hand, less than one cell; no script derives it.
    min_contact_cells : float, cells
        A smaller contact has no border that the grid resolves.
        Source: chosen by hand, a square of two cells; no script derives it.
    """

    margin_thicknesses: float = 0.75
    blunting_cells: float = 0.7
    min_contact_cells: float = 4.0


CONTACT_SHEAR = ContactShearParameters()
"""The values in use."""


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

    def __init__(self, grid: CoarseGrid, *, mm_per_px: float, elastomer: Elastomer) -> None:
        from scipy.fft import next_fast_len

        self._grid = grid
        width_mm, height_mm = self._cell_mm = mm_per_px * grid.cell_px
        margin_mm = CONTACT_SHEAR.margin_thicknesses * elastomer.thickness_mm
        self._margin = tuple(int(np.ceil(margin_mm / side)) for side in (height_mm, width_mm))
        rows, columns = self._shape = tuple(
            next_fast_len(count + 2 * margin, real=True)
            for count, margin in zip(grid.shape, self._margin, strict=True)
        )
        kx = 2 * np.pi * np.fft.rfftfreq(columns, width_mm)[None, :]
        ky = 2 * np.pi * np.fft.fftfreq(rows, height_mm)[:, None]
        k = np.hypot(kx, ky)
        cos, sin = (np.divide(side, k, out=np.zeros_like(k), where=k > 0) for side in (kx, ky))
        found = elastomer.compliance(k)
        along, across = (part / found.across[0, 0] for part in (found.along, found.across))
        response = np.stack(
            [
                along * cos**2 + across * sin**2,
                (along - across) * cos * sin,
                along * sin**2 + across * cos**2,
            ]
        )
        response[:, 0, 0] = 1, 0, 1
        # displacement along x under traction along x, along y under x, along y under y
        self._response = response.astype(np.float32)[:, None]
        self._x, self._y = (
            (side * np.arange(count)).astype(np.float32)
            for side, count in zip(self._cell_mm, self._shape[::-1], strict=True)
        )

    def fields(self, contact: Float32) -> Complex64 | None:
        """Return the displacement fields of a contact.

        Parameters
        ----------
        contact : (rows, columns) float32
            Share of each cell that is in contact.

        Returns
        -------
        (rows, columns, 4) complex64 or None
            x + iy of each field, up to a factor. None for a contact of less than four cells.
        """
        from scipy.fft import irfft2, rfft2

        if contact.sum() < CONTACT_SHEAR.min_contact_cells:
            return None
        spectra = self._response * rfft2(self._tractions(contact))
        uniform, x, y = spectra[:, 0], spectra[:, 1], spectra[:, 2]
        waves = np.concatenate([uniform, x[1:] - y[:2], x[:2] + y[1:]])
        (rows, columns), (top, left) = self._grid.shape, self._margin
        moved = irfft2(waves, s=self._shape)[:, top : top + rows, left : left + columns]
        return np.asarray(cv2.merge([moved[i] for i in _COMPONENTS]), np.float32).view(np.complex64)

    def _tractions(self, contact: Float32) -> Float32:
        """(3, …) traction of a contact, and its product with x and y from the centroid."""
        traction = self._traction(contact)
        total, x, y = traction.sum(), self._x, self._y
        x, y = x - traction.sum(0) @ x / total, y - traction.sum(1) @ y / total
        return np.stack([traction, traction * x, traction * y[:, None]])

    def _traction(self, contact: Float32) -> Float32:
        """Traction of a contact on the padded grid; the contact continues beyond the image."""
        (top, left), (rows, columns) = self._margin, self._shape
        bottom, right = rows - top - contact.shape[0], columns - left - contact.shape[1]
        wide = cv2.copyMakeBorder(contact, top, bottom, left, right, cv2.BORDER_REPLICATE)
        inside = np.asarray(wide > 0.5).view(np.uint8)
        depth = cv2.distanceTransform(inside, cv2.DIST_L2, cv2.DIST_MASK_5)
        return np.asarray(
            wide / np.sqrt(depth + np.float32(CONTACT_SHEAR.blunting_cells)), np.float32
        )
