"""What ROS calls a sensor: its topics, its frame, and the time of an observation."""

from __future__ import annotations

import math
import re
from typing import NamedTuple, Self

from tactile_core.quantities import Frame

_NOT_A_NAME = re.compile(r"[^A-Za-z0-9_]")


class SensorNames(NamedTuple):
    """Names of one sensor in ROS.

    Attributes
    ----------
    root : str
        Topic that all of its topics are below, such as ``/tactile/unit_7``.
    frame_id : str
        Frame of its messages: origin at the image centre, x right, y down, z away from the camera.
        REP 103 gives frames with these axes the suffix ``_optical``.
    """

    root: str
    frame_id: str

    @classmethod
    def of_unit(cls, serial: str | None, profile: str) -> Self:
        """Return the names of a unit, or of a sensor without a serial by its profile's name."""
        unit = ros_name(serial or profile)
        return cls(f"/tactile/{unit}", f"tactile_{unit}_optical")

    def topic(self, name: str) -> str:
        """Return the full name of a topic of this sensor."""
        return f"{self.root}/{name}"


def stamp_of(frame: Frame) -> int:
    """Return the time of a frame in ns: wall-clock time, or that of its recording."""
    # split, because a product of seconds since 1970 and 1e9 keeps no single nanoseconds
    rest, seconds = math.modf(frame.wall_time_s or frame.timestamp_s)
    return int(seconds) * 1_000_000_000 + round(rest * 1e9)


def ros_name(words: str) -> str:
    """Return a part of a topic's name: letters, digits and ``_``, and no digit in front."""
    name = _NOT_A_NAME.sub("_", words)
    return f"sensor_{name}" if not name or name[0].isdigit() or name[0] == "_" else name
