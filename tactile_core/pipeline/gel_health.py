"""Judges what the readings show of the lights and the markers."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from statistics import median

import numpy as np

from tactile_core.algorithms.drift import DRIFT
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.health import Finding
from tactile_core.pipeline.notes import saturation_warning
from tactile_core.quantities import Frame, MarkerField


class GEL_HEALTH:
    """Limits of what counts as a healthy gel."""

    readings = 30  # [count] Readings of which a median is taken. Source: one second at 30 Hz.
    # [share of the markers] Least share that is seen. Source: a contact over a tenth of the view
    # hides at most as many; twice that is unusual.
    seen = 0.8


class GelHealth:
    """Collects what readings show."""

    def __init__(self) -> None:
        self._seen: deque[int] = deque(maxlen=GEL_HEALTH.readings)
        self._expected = 0
        self._ratios: Mapping[str, float] = {}
        self._frame: Frame | None = None

    def add(self, reading: Reading) -> None:
        """Add a reading."""
        frame = self._frame = reading.frame
        markers = reading.get(MarkerField)
        if markers is not None:
            self._seen.append(int(np.count_nonzero(markers.seen)))
            self._expected = len(markers.ids)
        if frame.light_ratio is not None:
            self._ratios = dict(zip(frame.channels, frame.light_ratio.tolist(), strict=False))

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


def _light(name: str, ratio: float) -> Finding:
    problem = ""
    if abs(np.log(ratio)) > DRIFT.largest_log_gain:
        change = f"{abs(ratio - 1):.0%} {'brighter' if ratio > 1 else 'dimmer'}"
        problem = (
            f"the light in channel {name!r} is {change} than in the reference, too much to be "
            f"compensated; check its LEDs, its supply and the exposure, or record a new reference"
        )
    return Finding.judged(ratio, 1, "", problem)
