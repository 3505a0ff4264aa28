"""What there is to show of a sensor after one observation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tactile_core.interfaces.sink import Reading
from tactile_core.live.numbers import Entry
from tactile_core.quantities import Frame


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
    failure: str = ""


@dataclass(frozen=True)
class Sample:
    """The numbers of one observation, for the plots."""

    number: int
    taken_s: float
    values: dict[str, float]
