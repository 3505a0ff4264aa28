"""Judges what the readings show of the lights, the markers and the gel."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from statistics import median
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.drift import DRIFT
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.algorithms.wear import WearMap
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.health import Finding
from tactile_core.pipeline.notes import saturation_warning
from tactile_core.quantities import Bool, ContactMask, Frame, MarkerField, Reference


class GelHealthParameters(NamedTuple):
    """Limits of what counts as a healthy gel.

    Attributes
    ----------
    readings : int, count
        Readings of which a median is taken. Source: one second at 30 Hz.
    seen : float, share of the markers
        Least share that is seen. Source: a contact over a tenth of the view hides at most as many;
        twice that is unusual.
    worn : float, share of the gel
        Largest share that looks different. Source: ten scratches on the virtual rigs change 1.5 to
        7 %, noise 0.05 %.
    wear_interval_s : float, s
        Time between two observations that are compared for wear. Source: the comparison then
        takes less than a hundredth of the time.
    """

    readings: int = 30
    seen: float = 0.8
    worn: float = 0.02
    wear_interval_s: float = 0.5


GEL_HEALTH = GelHealthParameters()
"""The values in use."""


class GelHealth:
    """Collects what readings show.

    Parameters
    ----------
    thickness_mm : float or None
        Of the gel; None if the profile does not give it.
    """

    def __init__(self, thickness_mm: float | None) -> None:
        self._thickness_mm = thickness_mm or THICKNESS_MM
        self._seen: deque[int] = deque(maxlen=GEL_HEALTH.readings)
        self._expected = 0
        self._ratios: Mapping[str, float] = {}
        self._frame: Frame | None = None
        self._referred: Reference | None = None
        self._wear: WearMap | None = None
        self._compared_s = float("-inf")

    def add(self, reading: Reading, reference: Reference | None) -> None:
        """Add a reading and the reference of its pipeline."""
        frame = self._frame = reading.frame
        markers, contact = reading.get(MarkerField), reading.get(ContactMask)
        if markers is not None:
            self._seen.append(int(np.count_nonzero(markers.seen)))
            self._expected = len(markers.ids)
        if frame.light_ratio is not None:
            self._ratios = dict(zip(frame.channels, frame.light_ratio.tolist(), strict=False))
        if reference is not self._referred:
            self._referred, self._wear, self._compared_s = reference, None, float("-inf")
        if reference is None or reference.relative or contact is None:
            return
        if frame.timestamp_s - self._compared_s >= GEL_HEALTH.wear_interval_s:
            self._compared_s = frame.timestamp_s
            self._compare(frame, contact.mask, reference)

    def lights(self) -> Mapping[str, Finding]:
        """Brightness of each channel over that in the reference."""
        return {name: _light(name, ratio) for name, ratio in self._ratios.items()}

    def saturated(self) -> Finding:
        """Share of saturated intensities in the latest frame."""
        if self._frame is None:
            return Finding.unknown("there is no reading yet")
        return Finding.judged(self._frame.saturated_share, 0, "", saturation_warning(self._frame))

    def markers(self) -> Finding:
        """Markers that are seen, as a median."""
        if not self._seen:
            return Finding.unknown("no step tracks markers")
        seen, expected = round(median(self._seen)), self._expected
        problem = ""
        if seen < GEL_HEALTH.seen * expected:
            problem = (
                f"{seen} of {expected} markers are seen; clean the gel, check focus and lights, or "
                f"record a new reference"
            )
        return Finding.judged(seen, expected, "", problem)

    def wear(self) -> Finding:
        """Share of the gel that looks different although nothing touches it."""
        if any(found.verdict == "warning" for found in self.lights().values()):
            return Finding.unknown("the light has changed, and with it the look of the gel")
        if self._wear is None:
            return Finding.unknown("it takes a reference without contact and a step for contact")
        share = self._wear.share
        if share is None:
            return Finding.unknown("most of the gel has not been seen out of contact for a while")
        problem = ""
        if share > GEL_HEALTH.worn:
            problem = (
                f"{share:.0%} of the gel looks different from the reference although nothing "
                f"touches it; clean it, and if scratches or lost coating remain, replace it and "
                f"calibrate again"
            )
        return Finding.judged(share, 0, "", problem)

    def _compare(self, frame: Frame, contact: Bool, reference: Reference) -> None:
        if self._wear is None:
            self._wear = WearMap(reference.pixels, reference.full_scale, reference.marker_mask)
        stride = self._wear.stride
        half = slice(stride // 2, None, stride)
        touched = np.ascontiguousarray(contact[half, half]).view(np.uint8)
        # the surface of a bonded layer is deformed up to about its thickness from a contact
        reach = int(np.ceil(self._thickness_mm / (stride * frame.mm_per_px)))
        hidden = cv2.dilate(touched, np.ones((2 * reach + 1,) * 2, np.uint8)).astype(np.bool_)
        if frame.marker_mask is not None:
            hidden |= frame.marker_mask[half, half]
        self._wear.add(frame.pixels, hidden)


def _light(name: str, ratio: float) -> Finding:
    problem = ""
    if abs(np.log(ratio)) > DRIFT.largest_log_gain:
        change = f"{abs(ratio - 1):.0%} {'brighter' if ratio > 1 else 'dimmer'}"
        problem = (
            f"the light in channel {name!r} is {change} than in the reference, too much to be "
            f"compensated; check its LEDs, its supply and the exposure, or record a new reference"
        )
    return Finding.judged(ratio, 1, "", problem)
