"""One contact, followed from when its load has settled: how it is dragged, and what gives way."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.quantile import quantile
from tactile_core.algorithms.arrays.types import Array, Bool, Complex64, Intp
from tactile_core.algorithms.entropy import displacement_entropy
from tactile_core.algorithms.slip.cues import Cues
from tactile_core.algorithms.slip.plane import places_mm, since, strain
from tactile_core.algorithms.slip.stick_region import (
    NOISE_MM,
    StickRegion,
    calm_places,
    far_places,
    stick_region,
)

_LOAD_GROWS, _LOAD_GROWS_MUCH, _SHEARED_MM = 1.15, 1.6, 0.05
"""Shear alone changes the volume of a virtual contact by up to 13 %, its image by more: skin that
is dragged already begins anew only under a much larger load."""

_ENOUGH_PLACES = 12
_MOST_PLACES = 600
_EARLIER = 16
_SURE_NOISES, _MOVED_NOISES, _HALTED = 2.0, 10.0, 0.4
_BLURRED = 1.5
_FAR_QUANTILE = 0.95
_BEGINS = 0.7


class Load(NamedTuple):
    """How hard the object presses, in any unit; either part may grow alone.

    Attributes
    ----------
    area, depth : float
    """

    area: float
    depth: float


class ShearedContact:
    """Remembers the displacement fields of one contact.

    Parameters
    ----------
    spacing_mm : float
        Distance of neighbouring places of the fields.
    window_mm : float
        "Lately" is since the skin moved by so much.
    tolerance : float
        A place follows if it falls short of the core's motion by less than this share of it.
    noise_mm : float
        Of a displacement.

    Attributes
    ----------
    began : bool
        The load settled with the last field: all is told from there on.
    """

    def __init__(
        self,
        spacing_mm: float,
        *,
        window_mm: float = 0.1,
        tolerance: float = 0.1,
        noise_mm: float = NOISE_MM,
    ) -> None:
        self.spacing_mm, self.noise_mm = spacing_mm, noise_mm
        self.window_mm, self.tolerance = window_mm, tolerance
        self.release()

    def release(self) -> None:
        """Forget the contact."""
        self.began = False
        self._settled: Complex64 | None = None
        self._load = Load(0.0, 0.0)
        self._start_again()

    def update(self, field: Complex64, mask: Bool, load: Load, *, blurred: bool = False) -> Cues:
        """Judge the next field.

        Parameters
        ----------
        field : (h, w) complex64
            Displacement since the skin was untouched, x + iy in mm, of the skin now at each place.
        mask : (h, w) bool
            The contact.
        load : Load
        blurred : bool
            The field was made without knowing the contact, and does not bend at its border.
        """
        self.began = self._settled is None or self._grew(load)
        if self._settled is None or self.began:
            self._settled, self._load = field, load
            self._start_again()
        chosen = np.flatnonzero(mask)
        if len(chosen) < _ENOUGH_PLACES:
            return Cues()
        chosen = chosen[:: 1 + len(chosen) // _MOST_PLACES]
        moved = since(field, self._settled, self.spacing_mm)
        whole = self._whole(moved, chosen)
        self._sheared_mm = whole.sheared_mm
        before = self._following if self._judged else 0.0
        tolerance = self.tolerance
        if blurred:
            # a turn of the contact is rounded off at its border; a shift, hardly
            tolerance *= 1 + _BLURRED * (whole.turned_mm / max(whole.motion_mm, 1e-9)) ** 2
        self._follow(field, chosen, whole, tolerance)
        self._before.append(field)
        return Cues(
            self._following,
            max(0.0, before - self._following),
            self._stalled,
            whole.motion_mm,
            whole.turned_mm,
            whole.turn_rad,
            displacement_entropy(np.abs(moved), mask),
        )

    def _start_again(self) -> None:
        self._before: deque[Complex64] = deque(maxlen=_EARLIER)
        self._following, self._span = 1.0, 1
        self._judged = False
        self._peak_mm = self._stalled = self._sheared_mm = 0.0

    def _grew(self, load: Load) -> bool:
        """What spreads the skin under a growing load is no shear."""
        limit = _LOAD_GROWS if self._sheared_mm < _SHEARED_MM else _LOAD_GROWS_MUCH
        return any(now > limit * before for now, before in zip(load, self._load, strict=True))

    def _whole(self, moved: Complex64, chosen: Intp) -> StickRegion:
        displacement = moved.ravel()[chosen]
        strains = strain(moved, self.spacing_mm, chosen)
        return self._core(displacement, chosen, calm_places(displacement, strains), moved.shape)

    def _core(
        self, displacement: Complex64, chosen: Intp, start: Array, shape: tuple[int, ...]
    ) -> StickRegion:
        place = places_mm(shape, self.spacing_mm).ravel()[chosen]
        return stick_region(displacement, place, start, self.noise_mm)

    def _far(self, now: Complex64, before: Complex64, chosen: Intp) -> float:
        """How far the skin of the contact moved; that moves least where it slips."""
        moved = np.abs((now - before).ravel()[chosen])
        return quantile(moved, _FAR_QUANTILE)

    def _follow(self, field: Complex64, chosen: Intp, whole: StickRegion, tolerance: float) -> None:
        """Learn what share of the contact followed in the last motion, and how fast its core is.

        Frames are counted, not seconds: quasi-static motions have none.
        """
        earlier = len(self._before)
        if not earlier:
            return
        # motion is even: begin at the last frame's span
        span = min(max(1, self._span - 1), earlier)
        moved_mm = self._far(field, self._before[-span], chosen)
        while moved_mm < self.window_mm and span < earlier:
            span += 1
            moved_mm = self._far(field, self._before[-span], chosen)
        self._span = span
        if whole.motion_mm < _BEGINS * self.window_mm:
            return
        if moved_mm <= _MOVED_NOISES * self.noise_mm:
            self._slowed(moved_mm / span)
            return
        lately = since(field, self._before[-span], self.spacing_mm).ravel()[chosen]
        core = self._core(lately, chosen, whole.weight * far_places(lately), field.shape)
        following = core.following(tolerance, _SURE_NOISES * self.noise_mm)
        self._slowed(core.motion_mm / span)
        # skin that halts creeps as one, whether its object holds it or slides over it
        if self._stalled < _HALTED:
            self._following, self._judged = following, True

    def _slowed(self, rate_mm: float) -> None:
        self._peak_mm = max(self._peak_mm, rate_mm)
        self._stalled = 1 - rate_mm / max(self._peak_mm, 1e-9)
