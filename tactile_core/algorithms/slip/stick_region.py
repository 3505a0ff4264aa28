"""The region of a contact that sticks."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.types import TINY, Bool, Complex64, Intp


class STICK_REGION:
    """Parameters of the fit of the stick region."""

    # [mm] Noise of a displacement, the default of the option of ``core.slip``. Source: a tenth of
    # a pixel of 0.028 mm, the noise of a detected marker.
    noise_mm = 0.003
    # [share of the contact] Quantile of the strain that is typical of the stick region.
    calm_quantile = 0.2
    # [ratio] Strain relative to that quantile at which the initial weight falls to 1/e.
    calm_strains = 1.5
    min_strain = 1e-4  # [ratio] Lower bound of that quantile, for fields without noise
    rounds = 3  # [count] Rounds of reweighted least squares
    # [share of the motion] Lag at which the weight of a point falls to a quarter.
    lag_tolerance = 0.06
    # [ratio] Limit of the sine of the rotation, so that noise in a tiny contact stays finite.
    # Source: by hand, larger than any rotation of a gel.
    max_sine = 0.9
    distance_power = 6  # [exponent] Exponent of the displacement in the initial weights


class StickRegion(NamedTuple):
    """Rigid motion of the stick region, and the lag of the rest of the contact.

    Attributes
    ----------
    shift_mm : complex
        Displacement of the centroid of the contact, x + iy.
    rotation_rad : float
        Rotation about the centroid, positive from x towards y.
    motion_mm : float
        Root mean square of the rigid motion over the contact.
    rotation_mm : float
        The same for the rotation alone.
    sheared_mm : float
        The same for a rigid motion fitted to the whole contact; 0 for the spread under a load.
    lag_mm : (n,)
        Distance of each displacement from the rigid motion.
    weight : (n,)
        1 in the stick region, 0 where the surface lags far behind.
    """

    shift_mm: complex
    rotation_rad: float
    motion_mm: float
    rotation_mm: float
    sheared_mm: float
    lag_mm: NDArray[Any]
    weight: NDArray[Any]

    def stick_share(self, tolerance: float, noise_mm: float = STICK_REGION.noise_mm) -> float:
        """Return the share of the contact that lags by less than this share of the motion."""
        limit_mm = max(tolerance * self.motion_mm, noise_mm)
        return int(np.count_nonzero(self.lag_mm < limit_mm)) / len(self.lag_mm)


def calm_weights(displacement: Complex64, strain: NDArray[Any]) -> NDArray[Any]:
    """Return initial weights (n,): large for points with little strain and large displacement.

    Where the surface sticks it moves with the object and is not strained. Slip begins at the border
    of the contact and strains the surface there [1]_.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """
    calm = max(quantile(strain, STICK_REGION.calm_quantile), STICK_REGION.min_strain)
    relative = strain / (STICK_REGION.calm_strains * calm)
    return np.asarray(np.exp(-(relative**2)) * far_weights(displacement))


def far_weights(displacement: Complex64) -> NDArray[Any]:
    """Return weights (n,) that favour large displacements, since none exceeds the object's."""
    size = np.abs(displacement)
    return np.asarray((size / max(float(size.max()), 1e-9)) ** STICK_REGION.distance_power + 1e-6)


def stick_region(
    displacement: Complex64,
    position: Complex64,
    start: NDArray[Any],
    noise_mm: float = STICK_REGION.noise_mm,
    *,
    lag_tolerance: float = STICK_REGION.lag_tolerance,
) -> StickRegion:
    """Fit the rigid motion of the stick region, by iteratively reweighted least squares.

    Parameters
    ----------
    displacement : (n,) complex64
        Displacement of points of the contact since any earlier time, mm.
    position : (n,) complex64
        Present position of each point, mm.
    start : (n,)
        Initial weights: :func:`calm_weights`, or the stick region of a longer motion.
    noise_mm : float
        Noise of a displacement.
    lag_tolerance : float
        Lag at which the weight of a point falls to a quarter, relative to the motion.

    Returns
    -------
    StickRegion
    """
    weight, contact = start, _Contact(displacement, position)
    for _ in range(STICK_REGION.rounds):
        shift, rate = contact.rigid(weight)
        lag = np.abs(displacement - (shift + rate * contact.offset))
        motion = contact.motion(shift, rate)
        scale = max(lag_tolerance * motion, noise_mm)
        weight = 1 / (1 + (lag / scale) ** 2) ** 2
    return StickRegion(
        shift,
        math.asin(rate.imag),
        motion,
        contact.motion(0, rate),
        contact.motion(*contact.rigid(np.ones(len(position)))),
        lag,
        weight,
    )


class _Contact:
    """Points (n,) of a contact relative to its centroid, and their moments."""

    def __init__(self, displacement: Complex64, position: Complex64) -> None:
        self.offset = position - complex(position.sum()) / len(position)
        self._terms = terms = np.empty((7, len(position)))
        _, x, y, moved_x, moved_y, square, torque = terms
        terms[0] = 1
        x[:], y[:], moved_x[:], moved_y[:] = (
            *(self.offset.real, self.offset.imag),
            *(displacement.real, displacement.imag),
        )
        square[:], torque[:] = x * x + y * y, x * moved_y - y * moved_x
        self._square = float(square.sum()) / len(position)

    def rigid(self, weight: NDArray[Any]) -> tuple[complex, complex]:
        """Shift of the centroid, and displacement per mm of distance from it by a rotation."""
        total, x, y, moved_x, moved_y, square, torque = (self._terms @ weight).tolist()
        at, moved = complex(x, y) / total, complex(moved_x, moved_y) / total
        spread = max(square / total - abs(at) ** 2, TINY)
        sine = (torque / total - (at.conjugate() * moved).imag) / spread
        sine = min(max(sine, -STICK_REGION.max_sine), STICK_REGION.max_sine)
        # the field refers to present positions, so a rotation also has a radial part
        rate = complex(1 - math.sqrt(1 - sine**2), sine)
        return moved - rate * at, rate

    def motion(self, shift: complex, rate: complex) -> float:
        """Root mean square of a rigid motion over the contact."""
        return math.sqrt(abs(shift) ** 2 + abs(rate) ** 2 * self._square)


class WIDE_CONTACT:
    """Parameters of contacts wider than the view."""

    # [share of the view's border] A contact that covers more of the border is wider than the
    # view. Source: half, as for the contact area (ADR 31).
    border_share = 0.5
    # [exponent] Order of the polynomial. Source: virtual plates in shear: 2 and 3 warn alike, and
    # a slip zone along one side needs 3 (ADR 51).
    order = 3
    # [ratio] The squared share of rotation above which a motion is not smoothed: the swirl around
    # a stick region is not a polynomial of this order. Source: half, where rotation outweighs
    # translation.
    turned_share = 0.5
    # [share of the motion] Lag of a point that sticks. There is no blurred border, which needs
    # the larger tolerance of other contacts. Source: 95 % of the points of a virtual plate that
    # sticks lag by less (ADR 51).
    tolerance = 0.02
    # [share of the largest lag] Minimum tolerance of the lag: a polynomial rings where the
    # surface lags abruptly. Source: chosen on virtual plates that slip quasi-statically (ADR 51).
    ringing = 0.1
    # [ratio] Noise of one marker relative to the standard deviation that its field reports, which
    # also covers what lies between the markers. Source: 0.44 and 0.41 for virtual markers 1.1 and
    # 2.2 mm apart (ADR 51).
    noise_share = 0.43
    # [count] Markers of a field whose number is not known. Source: a view of 18 mm × 13 mm with
    # markers 1.1 mm apart.
    markers = 192
    # [standard deviations] Minimum tolerance of the lag. Source: 95 % quantile of a Rayleigh
    # distribution.
    sigmas = 2.45


def fills_view(mask: Bool) -> bool:
    """Return whether a contact (h, w) covers most of the border of the view."""
    return rim_share(mask) >= WIDE_CONTACT.border_share


def rim_share(mask: Bool) -> float:
    """Return the share of the border of the view that a mask (h, w) covers; corners count twice."""
    rim = _rim(mask.shape)
    return np.count_nonzero(mask.take(rim)) / len(rim)


@lru_cache(maxsize=4)
def _rim(shape: tuple[int, ...]) -> Intp:
    """Flat indices of the points at the border of the view; corners twice."""
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    return np.concatenate([index[0], index[-1], index[:, 0], index[:, -1]])


def smoothed_std_mm(std_mm: float, markers: int | None) -> float:
    """Return the standard deviation of a smoothed motion between two frames.

    Parameters
    ----------
    std_mm : float
        Reported standard deviation of the field.
    markers : int or None
        Number of markers that are seen; None if it is not known.
    """
    order = WIDE_CONTACT.order
    terms = (order + 1) * (order + 2) / 2
    count = max(WIDE_CONTACT.markers if markers is None else markers, terms)
    return WIDE_CONTACT.noise_share * std_mm * float(np.sqrt(2 * terms / count))


def smooth_displacement(displacement: Complex64, position: Complex64) -> Complex64:
    """Return displacements (n,) as a polynomial of the positions (n,), both x + iy in mm."""
    scale = max(float(np.abs(position).max()), 1e-9)
    x, y = position.real / scale, position.imag / scale
    order = WIDE_CONTACT.order
    terms: NDArray[Any] = np.stack(
        [x**i * y**j for i in range(order + 1) for j in range(order + 1 - i)], axis=1
    ).astype(np.float64)
    parts = np.stack([displacement.real, displacement.imag], axis=1).astype(np.float64)
    fitted = terms @ np.linalg.lstsq(terms, parts, rcond=None)[0]
    return np.asarray(fitted[:, 0] + 1j * fitted[:, 1], np.complex64)
