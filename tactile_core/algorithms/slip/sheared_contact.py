"""The displacement of one contact over time: its shear, and the share of it that sticks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.types import Bool, Complex64, Intp
from tactile_core.algorithms.slip.cues import Cues
from tactile_core.algorithms.slip.recent_fields import RecentFields, SpanLimits, positions_mm
from tactile_core.algorithms.slip.stick_region import (
    STICK_REGION,
    WIDE_CONTACT,
    StickRegion,
    far_weights,
    smooth_displacement,
    smoothed_std_mm,
    stick_region,
)
from tactile_core.algorithms.slip.touched import contact_motion, recent_motion


class SHEARED_CONTACT:
    """Parameters of the contact's history.

    The first two are defaults of options of ``core.slip``.
    """

    # [mm] Motion of the contact over which the stick share is measured. Source: chosen on virtual
    # sequences, better than 0.06 (ADR 31).
    window_mm = 0.1
    # [share of the motion] Lag of a point that sticks. Source: chosen on virtual sequences,
    # better than a fifth (ADR 31).
    tolerance = 0.1
    # [ratio] A load that grows by more starts the measurement again. Source: shear alone changes
    # the volume of a virtual contact by up to 13 %.
    load_growth = 1.15
    # [ratio] The same for a contact that is sheared already. Source: by hand, shear changes the
    # image of a contact by more than its volume.
    load_growth_sheared = 1.6
    sheared_mm = 0.05  # [mm] Shear above which a contact counts as sheared already
    # [count] Grid points of a contact that are needed, and that are used. Source: by hand, for
    # robustness and for speed.
    min_points = 12
    max_points = 600
    history_frames = 16  # [count] Frames that are kept. Source: by hand, for speed.
    stick_noises = 2.0  # [noise sigmas] Minimum tolerance of the lag of a point that sticks
    moved_noises = 10.0  # [noise sigmas] The stick share is not updated by smaller motions
    # [share of the peak speed] Deceleration above which the stick share no longer grows. Source:
    # by hand, on virtual sequences (ADR 31).
    decelerated = 0.4
    # [ratio] Growth of the tolerance with the share of the rotation, where the field is blurred
    # at the border of the contact. Source: by hand, on virtual sequences (ADR 31).
    blurred_tolerance = 1.5
    # [noise sigmas] A surface that did not move further from where it was an earlier frame
    # before, by more than this, rested or turned back; only its motion since then counts. Source:
    # one standard deviation; a slower motion is not measured over 16 frames either.
    rest_noises = 1.0
    # [share of the contact] Quantile of the displacement that represents the motion of the
    # object. Source: by hand, robust against a few outliers.
    far_quantile = 0.95
    min_window = 0.7  # [windows] The stick share is not measured over a shorter motion


class ContactLoad(NamedTuple):
    """The load on the contact, in any unit; either component may grow alone.

    Attributes
    ----------
    area, depth : float
    """

    area: float
    depth: float


class ShearedContact:
    """Estimate cues of slip from the displacement fields of one contact.

    Parameters
    ----------
    spacing_mm : float
        Distance between neighbouring grid points of the fields.
    window_mm : float
        Motion of the contact over which the stick share is measured.
    tolerance : float
        A point sticks if it lags behind the stick region by less than this share of its motion.
    noise_mm : float
        Noise of a displacement.

    Attributes
    ----------
    restarted : bool
        The load grew with the last field, so that displacements are measured from there.
    """

    def __init__(
        self,
        spacing_mm: float,
        *,
        window_mm: float = SHEARED_CONTACT.window_mm,
        tolerance: float = SHEARED_CONTACT.tolerance,
        noise_mm: float = STICK_REGION.noise_mm,
    ) -> None:
        self.spacing_mm, self.noise_mm = spacing_mm, noise_mm
        self.window_mm, self.tolerance = window_mm, tolerance
        # slipping points move less than those that stick, so the farthest are taken
        self._limits = SpanLimits(
            SHEARED_CONTACT.far_quantile, window_mm, SHEARED_CONTACT.rest_noises * noise_mm
        )
        self._before = RecentFields(SHEARED_CONTACT.history_frames)
        self.release()

    def release(self) -> None:
        """Forget the contact."""
        self.restarted = False
        self._settled: Complex64 | None = None
        self._load = ContactLoad(0.0, 0.0)
        self._restart()

    def update(
        self,
        field: Complex64,
        mask: Bool,
        load: ContactLoad,
        *,
        blurred: bool = False,
        wide: bool = False,
        std_mm: float | None = None,
        markers: int | None = None,
    ) -> Cues:
        """Return the cues of the next field.

        Parameters
        ----------
        field : (h, w) complex64
            Displacement from the reference, x + iy in mm, of the surface now at each grid point.
        mask : (h, w) bool
            The contact area.
        load : ContactLoad
        blurred : bool
            The field was estimated without the contact area, so it is smooth across its border.
        wide : bool
            The contact is wider than the view.
        std_mm : float, optional
            Standard deviation of the field in the contact, typically.
        markers : int, optional
            Number of markers that the field was estimated from.

        Returns
        -------
        Cues
        """
        self.restarted = self._settled is None or self._grew(load)
        if self._settled is None or self.restarted:
            self._settled, self._load = field, load
            self._restart()
        count = int(np.count_nonzero(mask))
        if count < SHEARED_CONTACT.min_points:
            return Cues()
        every = 1 + count // SHEARED_CONTACT.max_points
        moved = contact_motion(
            field,
            self._settled,
            self.spacing_mm,
            mask,
            every,
            noise_mm=self.noise_mm,
        )
        whole = moved.region
        self._sheared_mm = whole.sheared_mm
        before = self._stick_share if self._measured else 0.0
        tolerance = self.tolerance
        if blurred:
            # such a field underestimates a rotation near the border, but not a shift
            rotation_share = whole.rotation_mm / max(whole.motion_mm, 1e-9)
            tolerance *= 1 + SHEARED_CONTACT.blurred_tolerance * rotation_share**2
        wide_std_mm = None
        turned = whole.rotation_mm**2 > WIDE_CONTACT.turned_share * whole.motion_mm**2
        if wide and not turned:
            of_field_mm = self.noise_mm / WIDE_CONTACT.noise_share if std_mm is None else std_mm
            wide_std_mm = smoothed_std_mm(of_field_mm, markers)
        self._measure(field, moved.points, whole, tolerance, wide_std_mm)
        self._before.append(field)
        return Cues(
            self._stick_share,
            max(0.0, before - self._stick_share),
            self._deceleration,
            whole.motion_mm,
            whole.rotation_mm,
            whole.rotation_rad,
            moved.entropy_bits,
            wide_std_mm is not None,
        )

    def _restart(self) -> None:
        self._before.clear()
        self._stick_share = 1.0
        self._measured = False
        self._peak_mm = self._deceleration = self._sheared_mm = 0.0

    def _grew(self, load: ContactLoad) -> bool:
        """Whether the load grew: the surface then spreads, which is not shear."""
        limit = SHEARED_CONTACT.load_growth
        if self._sheared_mm >= SHEARED_CONTACT.sheared_mm:
            limit = SHEARED_CONTACT.load_growth_sheared
        area, depth = self._load
        return load.area > limit * area or load.depth > limit * depth

    def _measure(
        self,
        field: Complex64,
        points: Intp,
        whole: StickRegion,
        tolerance: float,
        wide_std_mm: float | None,
    ) -> None:
        """Update the stick share over the recent motion, and the speed of the stick region.

        Speed is per frame, not per second, because quasi-static motions have no time.
        """
        shortest_mm = SHEARED_CONTACT.min_window * self.window_mm
        if not self._before or whole.motion_mm < shortest_mm:
            return
        # the sum of motions around a rest, or there and back, is none of an object
        span, moved_mm = self._before.span(field, points, self._limits)
        if moved_mm <= SHEARED_CONTACT.moved_noises * self.noise_mm:
            self._update_speed(moved_mm / span)
            return
        recent, start = recent_motion(
            field,
            self._before[span],
            self.spacing_mm,
            points,
            whole.weight,
        )
        position = positions_mm(field.shape, self.spacing_mm).ravel()[points]
        if wide_std_mm is None:
            region = stick_region(recent, position, start, self.noise_mm)
            noise_mm = SHEARED_CONTACT.stick_noises * self.noise_mm
            stick_share = region.stick_share(tolerance, noise_mm)
        else:
            recent = smooth_displacement(recent, position)
            region = stick_region(
                recent,
                position,
                whole.weight * far_weights(recent),
                wide_std_mm,
                lag_tolerance=WIDE_CONTACT.tolerance,
            )
            largest_mm = quantile(region.lag_mm, SHEARED_CONTACT.far_quantile)
            least_mm = max(WIDE_CONTACT.sigmas * wide_std_mm, WIDE_CONTACT.ringing * largest_mm)
            stick_share = region.stick_share(WIDE_CONTACT.tolerance, least_mm)
        self._update_speed(region.motion_mm / span)
        # a surface that stops creeps uniformly, whether the object sticks or slides over it
        kept = self._deceleration >= SHEARED_CONTACT.decelerated and stick_share > self._stick_share
        if moved_mm >= shortest_mm and not kept:
            self._stick_share, self._measured = stick_share, True

    def _update_speed(self, rate_mm: float) -> None:
        self._peak_mm = max(self._peak_mm, rate_mm)
        self._deceleration = 1 - rate_mm / max(self._peak_mm, 1e-9)
