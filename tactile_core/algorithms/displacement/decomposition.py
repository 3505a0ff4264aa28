"""A displacement field taken apart as the papers draw it: shear, torsion and normal spread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_core.algorithms.displacement.derivatives import checked
from tactile_core.errors import InputError


@dataclass(frozen=True, eq=False)
class Decomposition:
    """Shift, turn and growth of the skin about a point, and what none of them explains.

    The skin that is now at x came from ``c − shear + turned back and shrunk (x − c)``. Angles and
    growth need not be small.

    Attributes
    ----------
    shear_mm : (2,) float64
        How far the skin at the centre was dragged: +x right, +y down.
    rotation_deg : float
        Turn about the centre, positive from x towards y.
    spread : float
        Growth of all lengths about the centre: 0.01 is 1 % larger, as under a normal load.
    centre_px : (2,) float64
        x and y of c in the present image.
    residual_mm : float
        RMS over the contact of what is left.
    mm_per_px : float
    """

    shear_mm: NDArray[np.float64]
    rotation_deg: float
    spread: float
    centre_px: NDArray[np.float64]
    residual_mm: float
    mm_per_px: float

    def shear_field(self, shape: tuple[int, int]) -> Float32:
        """(H, W, 2) in mm: the shift, the same everywhere."""
        return np.tile(self.shear_mm.astype(np.float32), (*shape, 1))

    def torsion_field(self, shape: tuple[int, int]) -> Float32:
        """(H, W, 2) in mm: the turn alone."""
        return self._turned(shape, 1.0)

    def spread_field(self, shape: tuple[int, int]) -> Float32:
        """(H, W, 2) in mm: what the growth adds to shift and turn."""
        return self._turned(shape, 1.0 + self.spread) - self._turned(shape, 1.0)

    def _turned(self, shape: tuple[int, int], growth: float) -> Float32:
        place = self.mm_per_px * _places(shape, self.centre_px)
        moved = place * (1 - np.exp(-1j * np.radians(self.rotation_deg)) / growth)
        return np.stack([moved.real, moved.imag], axis=-1).astype(np.float32)


def decomposed(
    displacement_mm: Array,
    mask: Bool | None = None,
    *,
    mm_per_px: float,
    centre_px: Array | None = None,
) -> Decomposition:
    """Take a field apart into shear, torsion and spread, by least squares over the contact.

    Yuan et al. (ICRA 2015, figures 3, 4 and 7; Sensors 2017, section 3.4) draw the three: under a
    shear load all of the contact moves alike, under torsion it turns about its middle, and under a
    normal load it spreads from it.

    Parameters
    ----------
    displacement_mm : (H, W, 2)
        The value at x belongs to the skin now at x.
    mask : (H, W) bool, optional
        The contact; by default the whole image.
    mm_per_px : float
        Scale of the image.
    centre_px : (2,), optional
        x and y of the point about which the skin turns and grows, by default the middle of the
        contact. Another one changes the shear alone.

    Returns
    -------
    Decomposition
        All zero for an empty contact; no turn and no growth for one of a single pixel.

    Raises
    ------
    InputError
        The shapes do not fit.
    """
    shape = checked(displacement_mm).shape[:2]
    if mask is not None and mask.shape != shape:
        raise InputError(f"the field is {shape} and the mask {mask.shape}; they must agree")
    rows, columns = np.nonzero(np.ones(shape, np.bool_) if mask is None else mask)
    if not len(rows):
        middle = (np.array(shape[::-1]) - 1) / 2
        return Decomposition(np.zeros(2), 0.0, 0.0, middle, 0.0, mm_per_px)
    middle = np.array([columns.mean(), rows.mean()])
    at = mm_per_px * ((columns - middle[0]) + 1j * (rows - middle[1]))
    moved = displacement_mm[rows, columns].astype(np.float64) @ np.array([1, 1j])
    shift = moved.mean()
    square = float(np.vdot(at, at).real)
    # where the skin was is a turned and shrunk picture of where it is, so that this is linear
    shrink = 1 - np.vdot(at, moved - shift) / square if square > 0 else 1.0 + 0j
    residual = moved - shift - (1 - shrink) * at
    if centre_px is not None:
        offset = mm_per_px * (np.asarray(centre_px, np.float64) - middle)
        shift = shift + (1 - shrink) * complex(*offset)
        middle = np.asarray(centre_px, np.float64)
    return Decomposition(
        np.array([shift.real, shift.imag]),
        float(-np.degrees(np.angle(shrink))),
        float(1 / max(abs(shrink), np.finfo(np.float32).tiny) - 1),
        middle,
        float(np.sqrt(np.mean(np.abs(residual) ** 2))),
        mm_per_px,
    )


def _places(shape: tuple[int, int], centre_px: NDArray[np.float64]) -> NDArray[np.complex128]:
    x, y = np.arange(shape[1]) - centre_px[0], np.arange(shape[0]) - centre_px[1]
    return np.asarray(x[None, :] + 1j * y[:, None])
