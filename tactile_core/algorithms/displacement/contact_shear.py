"""How a bonded layer moves under a contact: the displacement that markers are too sparse to show.

Between two markers the displacement bends sharply at the border of a contact, because nothing pulls
outside it. Where the contact is known, elasticity predicts that bend, whatever the object does
inside.
"""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Complex64, Float32
from tactile_core.algorithms.displacement.coarse_grid import CoarseGrid
from tactile_core.algorithms.elasticity import Elastomer

COUNT = 4
_COMPONENTS = 0, 1, 1, 2, 3, 4, 5, 6
_MARGIN_THICKNESSES = 0.75
_BLUNT_CELLS = 0.7
_FEWEST_CELLS = 4.0


class ContactShear:
    """Fields of a layer that is pulled along x and y, turned and stretched by a contact.

    The traction grows towards the border of the contact as 1/√distance, as under any stiff object
    that sticks.

    Parameters
    ----------
    grid : CoarseGrid
    mm_per_px : float
        Scale of the image.
    elastomer : Elastomer
        Its thickness and Poisson's ratio matter, its modulus does not.
    """

    def __init__(self, grid: CoarseGrid, *, mm_per_px: float, elastomer: Elastomer) -> None:
        from scipy.fft import next_fast_len

        self._grid = grid
        width_mm, height_mm = self._cell_mm = mm_per_px * grid.cell_px
        margin_mm = _MARGIN_THICKNESSES * elastomer.thickness_mm
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
        # along x of a pull along x, of the one along the other, along y of a pull along y
        self._response = response.astype(np.float32)[:, None]
        self._x, self._y = (
            (side * np.arange(count)).astype(np.float32)
            for side, count in zip(self._cell_mm, self._shape[::-1], strict=True)
        )

    def fields(self, contact: Float32) -> Complex64 | None:
        """Return the fields of a contact.

        Parameters
        ----------
        contact : (rows, columns) float32
            Share of each cell that is in contact, on the grid.

        Returns
        -------
        (rows, columns, 4) complex64 or None
            x + iy, in no unit. None for a contact that is too small to have a border of its own.
        """
        from scipy.fft import irfft2, rfft2

        if contact.sum() < _FEWEST_CELLS:
            return None
        answers = self._response * rfft2(self._pulls(contact))
        even, x, y = answers[:, 0], answers[:, 1], answers[:, 2]
        waves = np.concatenate([even, x[1:] - y[:2], x[:2] + y[1:]])
        (rows, columns), (top, left) = self._grid.shape, self._margin
        moved = irfft2(waves, s=self._shape)[:, top : top + rows, left : left + columns]
        return np.asarray(cv2.merge([moved[i] for i in _COMPONENTS]), np.float32).view(np.complex64)

    def _pulls(self, contact: Float32) -> Float32:
        """(3, …) pull of a contact, and that times x and y from its middle."""
        pull = self._pull(contact)
        total, x, y = pull.sum(), self._x, self._y
        x, y = x - pull.sum(0) @ x / total, y - pull.sum(1) @ y / total
        return np.stack([pull, pull * x, pull * y[:, None]])

    def _pull(self, contact: Float32) -> Float32:
        """The contact with a margin, in which it goes on as at the border of the image."""
        (top, left), (rows, columns) = self._margin, self._shape
        bottom, right = rows - top - contact.shape[0], columns - left - contact.shape[1]
        wide = cv2.copyMakeBorder(contact, top, bottom, left, right, cv2.BORDER_REPLICATE)
        inside = np.asarray(wide > 0.5).view(np.uint8)
        depth = cv2.distanceTransform(inside, cv2.DIST_L2, cv2.DIST_MASK_5)
        return np.asarray(wide / np.sqrt(depth + np.float32(_BLUNT_CELLS)), np.float32)
