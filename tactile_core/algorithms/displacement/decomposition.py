"""A displacement field's shear, torsion, spread and derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_core.errors import InputError


def divergence(displacement_mm: Array, *, mm_per_px: float) -> Float32:
    """Return the divergence ∂u/∂x + ∂v/∂y, the areal strain of the gel surface.

    Central differences; one-sided at the border of the image.

    Parameters
    ----------
    displacement_mm : (H, W, 2)
        u and v: +x right, +y down.
    mm_per_px : float
        Scale of the image.

    Returns
    -------
    (H, W) float32
        Dimensionless; positive where the surface expands, as under a normal load.

    Raises
    ------
    InputError
        The field is not (H, W, 2), or narrower than two pixels.
    """
    u, v = _parts(displacement_mm)
    return np.asarray((np.gradient(u, axis=1) + np.gradient(v, axis=0)) / np.float32(mm_per_px))


def curl(displacement_mm: Array, *, mm_per_px: float) -> Float32:
    """Return the curl ∂v/∂x − ∂u/∂y, twice the local rotation of the gel surface in rad.

    Central differences; one-sided at the border of the image.

    Parameters
    ----------
    displacement_mm : (H, W, 2)
        u and v: +x right, +y down.
    mm_per_px : float
        Scale of the image.

    Returns
    -------
    (H, W) float32
        Dimensionless; positive where the surface rotates from x towards y.

    Raises
    ------
    InputError
        The field is not (H, W, 2), or narrower than two pixels.
    """
    u, v = _parts(displacement_mm)
    return np.asarray((np.gradient(v, axis=1) - np.gradient(u, axis=0)) / np.float32(mm_per_px))


def check_field(displacement_mm: Array) -> Array:
    """Return the field after checking its shape.

    Raises
    ------
    InputError
        The field is not (H, W, 2), or narrower than two pixels.
    """
    shape = displacement_mm.shape
    if len(shape) != 3 or shape[2] != 2 or min(shape[:2]) < 2:
        raise InputError(f"a displacement field is (H, W, 2); this one is {shape}")
    return displacement_mm


def _parts(displacement_mm: Array) -> Float32:
    return np.asarray(np.moveaxis(check_field(displacement_mm), 2, 0), np.float32, order="C")


@dataclass(frozen=True, eq=False)
class Decomposition:
    """Shear, rotation and spread of the gel surface about a point, and the residual.

    The surface point that is now at x was at ``c − shear + R⁻¹ (x − c) / (1 + spread)``, with the
    rotation R. Neither the angle nor the spread needs to be small.

    Attributes
    ----------
    shear_mm : (2,) float64
        Shear displacement of the surface at the centre: +x right, +y down.
    rotation_deg : float
        Rotation about the centre, positive from x towards y.
    spread : float
        Relative expansion about the centre: 0.01 is 1 %, as under a normal load.
    centre_px : (2,) float64
        x and y of the centre c in the current image.
    residual_mm : float
        RMS of the residual over the contact.
    mm_per_px : float
        Scale of the image.
    """

    shear_mm: NDArray[np.float64]
    rotation_deg: float
    spread: float
    centre_px: NDArray[np.float64]
    residual_mm: float
    mm_per_px: float

    def shear_field(self, shape: tuple[int, int]) -> Float32:
        """Return the uniform shear displacement (H, W, 2), mm."""
        return np.tile(self.shear_mm.astype(np.float32), (*shape, 1))

    def torsion_field(self, shape: tuple[int, int]) -> Float32:
        """Return the displacement (H, W, 2) due to the rotation, mm."""
        return self._rotation_field(shape, 1.0)

    def spread_field(self, shape: tuple[int, int]) -> Float32:
        """Return the displacement (H, W, 2) that the spread adds to shear and rotation, mm."""
        return self._rotation_field(shape, 1.0 + self.spread) - self._rotation_field(shape, 1.0)

    def _rotation_field(self, shape: tuple[int, int], growth: float) -> Float32:
        place = self.mm_per_px * _places(shape, self.centre_px)
        moved = place * (1 - np.exp(-1j * np.radians(self.rotation_deg)) / growth)
        return np.stack([moved.real, moved.imag], axis=-1).astype(np.float32)


def decompose_field(
    displacement_mm: Array,
    mask: Bool | None = None,
    *,
    mm_per_px: float,
    centre_px: Array | None = None,
) -> Decomposition:
    """Decompose a field into shear, torsion and spread, by least squares over the contact.

    The papers show all three patterns ([1]_, figures 3, 4 and 7; [2]_, section 3.4): under a shear
    load the whole contact moves uniformly, under torsion it rotates about its centre, and under a
    normal load it spreads from there.

    Parameters
    ----------
    displacement_mm : (H, W, 2)
        Displacement of the surface point that is now at each pixel.
    mask : (H, W) bool, optional
        The contact area. Default: the whole image.
    mm_per_px : float
        Scale of the image.
    centre_px : (2,), optional
        x and y of the centre of rotation and spread. Default: the centroid of the contact. The
        choice affects only the shear.

    Returns
    -------
    Decomposition
        All zero for an empty contact; no rotation and no spread for a single pixel.

    Raises
    ------
    InputError
        The shapes do not match.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    .. [2] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-resolution robot tactile sensors for
       estimating geometry and force", Sensors 17(12), 2017.
    """
    shape = check_field(displacement_mm).shape[:2]
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
    # in complex numbers the former positions are linear in the present ones
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


# [mm] Width of a bin of the histogram. It is fixed: with a fixed number of bins the width
# would grow with the load, and the entropy with it less. Source: by hand, so that virtual
# grasps reach the entropy of the 2015 paper (``docs/building/slip_curves.py``).
BIN_MM = 1 / 256


def displacement_entropy(
    displacement_mm: Array, mask: Bool | None = None, *, bin_mm: float = BIN_MM
) -> float:
    """Return the entropy of the displacement's magnitude over the contact, in bits.

    It is −Σ p log2 p over a histogram of the magnitude [1]_, section III-B. It is small while the
    whole contact moves uniformly and grows when its border starts to slip. Marker noise of 0.1 px
    alone gives about 1.5 bits.

    Parameters
    ----------
    displacement_mm : (H, W, 2) or (H, W)
        Displacement of the gel surface, or its magnitude.
    mask : (H, W) bool, optional
        The contact area. Default: the whole image.
    bin_mm : float
        Width of a bin.

    Returns
    -------
    float
        0 for an empty contact. A large contact is subsampled, which changes the entropy by less
        than 0.02 bits.

    Raises
    ------
    InputError
        The shapes do not match, or ``bin_mm`` is not positive.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """
    shape = displacement_mm.shape
    if len(shape) not in (2, 3) or shape[2:] not in ((), (2,)) or 0 in shape:
        raise InputError(f"a displacement field is (H, W, 2) or (H, W); this one is {shape}")
    if mask is not None and mask.shape != shape[:2]:
        raise InputError(f"the field is {shape[:2]} and the mask {mask.shape}; they must agree")
    if not bin_mm > 0:
        raise InputError(f"a bin width of {bin_mm} mm is not positive; give a width above 0")
    counted = shape[0] * shape[1] if mask is None else int(np.count_nonzero(mask))
    if not counted:
        return 0.0
    # [pixels] The entropy changes by less than 0.02 bits
    step = max(1, int(np.sqrt(counted / 30_000)))
    sampled = None if mask is None else np.ascontiguousarray(mask[::step, ::step])
    magnitude = _magnitude(displacement_mm[::step, ::step]) / np.float32(bin_mm)
    if sampled is not None:
        magnitude = magnitude[sampled]
    counts = np.bincount(magnitude.ravel().astype(np.int64))
    share = counts[counts > 0] / magnitude.size
    return float(max(0.0, -(share * np.log2(share)).sum()))


def _magnitude(field: Array) -> NDArray[np.float32]:
    if field.ndim == 2:
        return np.abs(np.asarray(field, np.float32))
    x, y = cv2.split(np.asarray(field, np.float32))
    return np.asarray(cv2.magnitude(x, y))
