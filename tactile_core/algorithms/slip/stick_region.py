"""The part of the contact that sticks: it moves with the object, and so as a rigid body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.quantile import quantile
from tactile_core.algorithms.arrays.types import Complex64

NOISE_MM = 0.003
"""Of a displacement: a tenth of a pixel of the usual view."""

_CALM_QUANTILE, _CALM_STRAINS, _LEAST_STRAIN = 0.2, 1.5, 1e-4
_ROUNDS = 3
_CORE_TOLERANCE = 0.06
_LARGEST_SINE = 0.9
_FAR_POWER = 6
_TINY = 1e-12


@dataclass(frozen=True)
class StickRegion:
    """How the sticking core of a contact moved, and how much of the contact moved alike.

    Attributes
    ----------
    shift_mm : complex
        Of the contact's middle: x + iy.
    turn_rad : float
        About that, from x towards y.
    motion_mm : float
        Root mean square over the contact of the core's motion.
    turned_mm : float
        The same of its turn alone.
    sheared_mm : float
        The same of the contact as a whole: 0 where skin is spread by a load.
    lag_mm : (n,)
        By how much each place fell short of that motion.
    weight : (n,)
        1 in the core, 0 where the skin lags far behind.
    """

    shift_mm: complex
    turn_rad: float
    motion_mm: float
    turned_mm: float
    sheared_mm: float
    lag_mm: NDArray[Any]
    weight: NDArray[Any]

    def following(self, tolerance: float, noise_mm: float = NOISE_MM) -> float:
        """Share of the contact that followed the core, but for this share of its motion."""
        return float(np.mean(self.lag_mm < max(tolerance * self.motion_mm, noise_mm)))


def calm_places(displacement: Complex64, strain: NDArray[Any]) -> NDArray[Any]:
    """(n,) weights of the least strained and farthest moved places.

    Where the skin sticks it moves with the object, so that it is not strained; slip begins at the
    border of the contact and strains the skin there [Yuan 2015].
    """
    calm = max(quantile(strain, _CALM_QUANTILE), _LEAST_STRAIN)
    return np.asarray(np.exp(-((strain / (_CALM_STRAINS * calm)) ** 2)) * far_places(displacement))


def far_places(displacement: Complex64) -> NDArray[Any]:
    """(n,) weights of the farthest moved places: nothing outruns the object."""
    size = np.abs(displacement)
    return np.asarray((size / max(float(size.max()), 1e-9)) ** _FAR_POWER + 1e-6)


def stick_region(
    displacement: Complex64, place: Complex64, start: NDArray[Any], noise_mm: float = NOISE_MM
) -> StickRegion:
    """Find the rigid motion of the skin that sticks to the object, by reweighted least squares.

    Parameters
    ----------
    displacement : (n,) complex64
        At places of the contact, since a time at which it may have been anything.
    place : (n,) complex64
        Where each is now, mm.
    start : (n,)
        Weights to begin with: :func:`calm_places`, or the core of a longer motion.
    noise_mm : float
        Of a displacement.
    """
    weight, contact = start, _Contact(displacement, place)
    for _ in range(_ROUNDS):
        shift, rate = contact.rigid(weight)
        lag = np.abs(displacement - (shift + rate * contact.away))
        motion = contact.motion(shift, rate)
        weight = 1 / (1 + (lag / max(_CORE_TOLERANCE * motion, noise_mm)) ** 2) ** 2
    return StickRegion(
        shift,
        math.asin(rate.imag),
        motion,
        contact.motion(0, rate),
        contact.motion(*contact.rigid(np.ones(len(place)))),
        lag,
        weight,
    )


class _Contact:
    """Places (n,) of a contact from its middle, and what their displacements sum up to."""

    def __init__(self, displacement: Complex64, place: Complex64) -> None:
        self.away = place - complex(place.sum()) / len(place)
        self._terms = terms = np.empty((7, len(place)))
        _, x, y, moved_x, moved_y, square, turned = terms
        terms[0] = 1
        x[:], y[:], moved_x[:], moved_y[:] = (
            *(self.away.real, self.away.imag),
            *(displacement.real, displacement.imag),
        )
        square[:], turned[:] = x * x + y * y, x * moved_y - y * moved_x
        self._square = float(square.sum()) / len(place)

    def rigid(self, weight: NDArray[Any]) -> tuple[complex, complex]:
        """Shift of the middle, and what a turn about it displaces for each mm away from it."""
        total, *sums = (self._terms @ weight).tolist()
        x, y, moved_x, moved_y, square, turned = (value / total for value in sums)
        at, moved = complex(x, y), complex(moved_x, moved_y)
        spread = max(square - abs(at) ** 2, _TINY)
        sine = (turned - (at.conjugate() * moved).imag) / spread
        sine = min(max(sine, -_LARGEST_SINE), _LARGEST_SINE)
        # the field belongs to the skin's present places: a turn pulls it outwards a little, too
        rate = complex(1 - math.sqrt(1 - sine**2), sine)
        return moved - rate * at, rate

    def motion(self, shift: complex, rate: complex) -> float:
        """Root mean square over the contact of a rigid motion."""
        return math.sqrt(abs(shift) ** 2 + abs(rate) ** 2 * self._square)
