"""The shear of a contact in its displacement field, and the share of the contact that sticks.

Where an object sticks, the gel surface moves with it as a rigid body; where it slips, the surface
lags behind, from the border of the contact inwards. So one rigid motion is fitted to the points
that move furthest, and a point sticks if it lags behind by no more than the noise.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.types import TINY, Bool, Complex64, Intp
from tactile_core.algorithms.displacement.decomposition import displacement_entropy
from tactile_core.algorithms.slip.plane import displacement_since, positions_mm, since_at


class SHEAR_FIELD:
    """Parameters of the shear of a contact."""

    # [mm] Noise of a displacement along x or y. Source: a tenth of a pixel of 0.028 mm, the noise
    # of a detected marker.
    noise_mm = 0.003
    # [noise sigmas] Lag of a point that sticks, between two fields. Source: 99 % quantile of a
    # Rayleigh distribution.
    stick_noises = 3.03
    # [mm] Motion of the contact over which the stick share is measured. Source: chosen on virtual
    # sequences, better than 0.06 (ADR 29).
    window_mm = 0.1
    min_window = 0.7  # [windows] The stick share is not measured over a shorter motion


class ContactLoad(NamedTuple):
    """The load on the contact, in any unit; either component may grow alone.

    Attributes
    ----------
    area, depth : float
    """

    area: float
    depth: float


class MeasuredShear(NamedTuple):
    """The shear of a contact since its load settled.

    Attributes
    ----------
    stick_share : float
        Share of the contact that moved with its stick region recently.
    motion_mm, rotation_mm : float
        Root mean square over the contact of the rigid motion of the stick region, and of its
        rotation alone.
    rotation_rad : float
        Rotation of the stick region, positive from x towards y.
    entropy_bits : float
        Entropy of the magnitude of the displacement [1]_.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """

    stick_share: float = 1.0
    motion_mm: float = 0.0
    rotation_mm: float = 0.0
    rotation_rad: float = 0.0
    entropy_bits: float = 0.0


class ShearedContact:
    """Measure the shear of one contact from its displacement fields.

    Parameters
    ----------
    spacing_mm : float
        Distance between neighbouring grid points of the fields.
    window_mm : float
        Motion of the contact over which the stick share is measured.
    noise_mm : float
        Noise of a displacement along x or y.

    Attributes
    ----------
    restarted : bool
        The load grew with the last field, so that displacements are measured from there.
    """

    def __init__(
        self,
        spacing_mm: float,
        *,
        window_mm: float = SHEAR_FIELD.window_mm,
        noise_mm: float = SHEAR_FIELD.noise_mm,
    ) -> None:
        self.spacing_mm, self.window_mm, self.noise_mm = spacing_mm, window_mm, noise_mm
        self._recent = deque[Complex64](maxlen=16)  # [frames] for speed
        self.release()

    def release(self) -> None:
        """Forget the contact."""
        self.restarted = False
        self._settled: Complex64 | None = None
        self._load = ContactLoad(0.0, 0.0)
        self._sheared_mm = 0.0

    def update(self, field: Complex64, mask: Bool, load: ContactLoad) -> MeasuredShear:
        """Return the shear of the next field.

        Parameters
        ----------
        field : (h, w) complex64
            Displacement from the reference, x + iy in mm, of the surface now at each grid point.
        mask : (h, w) bool
            The contact area.
        load : ContactLoad

        Returns
        -------
        MeasuredShear
        """
        self.restarted = self._settled is None or self._grew(load)
        if self._settled is None or self.restarted:
            self._settled, self._load = field, load
            self._sheared_mm, self._stick_share = 0.0, 1.0
            self._recent.clear()
        count = int(np.count_nonzero(mask))
        if count < 12:  # [points] too few for a motion
            return MeasuredShear()
        points = np.flatnonzero(mask)[:: 1 + count // 600]  # [points] for speed
        position = positions_mm(mask.shape, self.spacing_mm).ravel()[points]
        moved, entropy_bits = self._displace(field, mask, points)
        whole = fit_rigid_motion(moved, position, guess_sticking(moved, position), self.noise_mm)
        self._sheared_mm = whole.sheared_mm
        if whole.motion_mm >= SHEAR_FIELD.min_window * self.window_mm:
            self._measure_sticking(field, points, position, whole)
        self._recent.append(field.copy())
        return MeasuredShear(
            self._stick_share,
            whole.motion_mm,
            whole.rotation_mm,
            whole.rotation_rad,
            entropy_bits,
        )

    def _grew(self, load: ContactLoad) -> bool:
        """Whether the load grew: the surface then spreads, which is not shear."""
        limit = 1.15  # [ratio] Shear alone changes the volume of a virtual contact by up to 13 %
        if self._sheared_mm >= 0.05:  # [mm]
            limit = 1.6  # [ratio] shear changes the image by more than the volume
        area, depth = self._load
        return load.area > limit * area or load.depth > limit * depth

    def _displace(self, field: Complex64, mask: Bool, points: Intp) -> tuple[Complex64, float]:
        """Displacement (n,) of points since the load settled, and the entropy of all of them."""
        assert self._settled is not None
        left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
        window = slice(top, top + height), slice(left, left + width)
        moved = displacement_since(field, self._settled, self.spacing_mm, window=window)
        entropy_bits = displacement_entropy(np.abs(moved), mask[window])
        rows, columns = np.unravel_index(points, mask.shape)
        return moved[rows - top, columns - left], entropy_bits

    def _measure_sticking(
        self, field: Complex64, points: Intp, position: Complex64, whole: RigidMotion
    ) -> None:
        """Measure the stick share over the recent motion, if that is long enough."""
        moved_mm, before = self._find_window(field, points)
        if before is None or moved_mm < SHEAR_FIELD.min_window * self.window_mm:
            return
        recent = since_at(field, before, self.spacing_mm, points)
        start = whole.weight * guess_sticking(recent, position)
        lag_mm = fit_rigid_motion(recent, position, start, self.noise_mm).lag_mm
        limit_mm = SHEAR_FIELD.stick_noises * math.sqrt(2) * self.noise_mm
        self._stick_share = np.count_nonzero(lag_mm < limit_mm) / len(lag_mm)

    def _find_window(self, field: Complex64, points: Intp) -> tuple[float, Complex64 | None]:
        """Motion since the latest field that the points have left by a window, and that field.

        An earlier one if the surface rested or turned back in between: the sum of motions around a
        rest, or there and back, is none of an object.
        """
        there, moved_mm, found = field.ravel()[points], 0.0, None
        for before in reversed(self._recent):
            change = np.abs(there - before.ravel()[points])
            longer_mm = quantile(change, 0.95)  # [share] robust against a few outliers
            if found is not None and longer_mm < moved_mm + self.noise_mm:
                break
            moved_mm, found = longer_mm, before
            if moved_mm >= self.window_mm:
                break
        return moved_mm, found


class RigidMotion(NamedTuple):
    """Rigid motion of the points that stick, and the lag of all.

    Attributes
    ----------
    shift_mm : complex
        Displacement of the centroid of the contact, x + iy.
    rotation_rad : float
        Rotation about the centroid, positive from x towards y.
    motion_mm, rotation_mm : float
        Root mean square of the motion over the contact, and of the rotation alone.
    sheared_mm : float
        The same for a rigid motion fitted to the whole contact; 0 for the spread under a load.
    lag_mm : (n,)
        Distance of each displacement from the rigid motion.
    weight : (n,)
        1 where the surface sticks, 0 where it lags far behind.
    """

    shift_mm: complex
    rotation_rad: float
    motion_mm: float
    rotation_mm: float
    sheared_mm: float
    lag_mm: NDArray[Any]
    weight: NDArray[Any]


def guess_sticking(displacement: Complex64, position: Complex64) -> NDArray[Any]:
    """Return weights (n,) that are large for points that probably stick.

    No point moves further than the object, and slip begins at the border of the contact [1]_.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """
    size, square = np.abs(displacement), np.abs(position - position.mean()) ** 2
    # [exponent] None exceeds the displacement of the object
    far = (size / max(float(size.max()), TINY)) ** 6
    return np.asarray(far * np.exp(-square / max(float(square.mean()), TINY)) + 1e-6)


def fit_rigid_motion(
    displacement: Complex64, position: Complex64, start: NDArray[Any], noise_mm: float
) -> RigidMotion:
    """Fit the rigid motion of the points that stick, by iteratively reweighted least squares.

    Parameters
    ----------
    displacement : (n,) complex64
        Displacement of points of the contact since any earlier time, mm.
    position : (n,) complex64
        Present position of each point, mm.
    start : (n,)
        Initial weights: :func:`guess_sticking`, perhaps times those of a longer motion.
    noise_mm : float
        Noise of a displacement.

    Returns
    -------
    RigidMotion
    """
    weight, offset = start, position - complex(position.sum()) / len(position)
    square_mm = float(np.mean(np.abs(offset) ** 2))
    for _ in range(6):  # [reweightings]
        shift, rate = _solve_rigid(displacement, offset, weight)
        lag = np.abs(displacement - (shift + rate * offset))
        motion_mm = math.sqrt(abs(shift) ** 2 + abs(rate) ** 2 * square_mm)
        scale = max(0.06 * motion_mm, noise_mm)  # [share] there a weight falls to a quarter
        weight = 1 / (1 + (lag / scale) ** 2) ** 2
    whole_shift, whole_rate = _solve_rigid(displacement, offset, np.ones(len(offset)))
    return RigidMotion(
        shift,
        math.asin(rate.imag),
        motion_mm,
        abs(rate) * math.sqrt(square_mm),
        math.sqrt(abs(whole_shift) ** 2 + abs(whole_rate) ** 2 * square_mm),
        lag,
        weight,
    )


def _solve_rigid(
    displacement: Complex64, offset: Complex64, weight: NDArray[Any]
) -> tuple[complex, complex]:
    """Shift of the centroid, and displacement per mm of distance from it by a rotation."""
    total = weight.sum()
    at, moved = (complex(weight @ each) / total for each in (offset, displacement))
    around = offset - at
    spread = max(float(weight @ np.abs(around) ** 2), TINY)
    sine = complex(weight @ (around.conj() * (displacement - moved))).imag / spread
    # larger than any rotation of a gel; noise in a tiny contact stays finite
    sine = min(max(sine, -0.9), 0.9)
    # the field refers to present positions, so a rotation also has a radial part
    rate = complex(1 - math.sqrt(1 - sine**2), sine)
    return moved - rate * at, rate
