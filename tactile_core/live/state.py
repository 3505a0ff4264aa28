"""The state of a sensor on the page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_core.interfaces.reading import Reading
from tactile_core.live.numbers import Entry
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Frame,
    HeightMap,
    Quantity,
    Wrench,
)
from tactile_core.sim.truth import TrueState


@dataclass(frozen=True, eq=False)
class LiveState:
    """What there is to show of a sensor after one observation.

    Attributes
    ----------
    number : int
        Counts the observations of this session.
    reading : Reading
    frame : Frame
        As the camera sent it.
    taken_s : float
        Host time at mid-observation; of a recording, when it was played.
    entries : tuple of Entry
        Numbers and words of the reading.
    faults : tuple of str
        What could not be read from it.
    rate_hz : float
        Observations a second.
    health : mapping
        As of ``tactile doctor --watch --json``.
    truth : TrueState or None
        Of a virtual sensor with a hand.
    failure : str
        Why there is no newer observation; empty if all is well.
    """

    number: int
    reading: Reading
    frame: Frame
    taken_s: float
    entries: tuple[Entry, ...]
    faults: tuple[str, ...]
    rate_hz: float
    health: dict[str, Any]
    truth: TrueState | None = None
    failure: str = ""


@dataclass(frozen=True)
class Sample:
    """The numbers of one observation, for the plots."""

    number: int
    taken_s: float
    values: dict[str, float]


def true_quantities(truth: TrueState) -> tuple[Quantity, ...]:
    """Return height, contact, displacement and force, as a perfect sensor would measure them."""
    everywhere = np.ones(truth.height_mm.shape, np.bool_)
    fx, fy, fz, tz = map(float, truth.wrench)
    return (
        HeightMap(truth.height_mm, everywhere, truth.mm_per_px, truth.time_s),
        ContactMask(truth.contact, truth.mm_per_px, truth.time_s),
        DisplacementField(truth.displacement_mm, everywhere, truth.mm_per_px, truth.time_s),
        Wrench(fx, fy, fz, tz, timestamp_s=truth.time_s),
    )
