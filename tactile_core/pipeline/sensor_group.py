"""Several sensors, such as the fingers of a gripper, whose readings are paired by their time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from tactile_core.errors import InputError
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.sensor import Sensor


@dataclass(frozen=True, eq=False)
class PairedReadings:
    """One reading of each sensor, taken at about the same time.

    Attributes
    ----------
    readings : tuple of Reading
        In the order of the sensors.
    apart_s : float
        Time between the first and the last of them.
    """

    readings: tuple[Reading, ...]
    apart_s: float


class SensorGroup:
    """Open sensors whose readings belong together where their times do.

    All sensors need the same clock: live cameras of one host, or recordings that were started
    together.

    Parameters
    ----------
    sensors : sequence of Sensor
        Open; the group closes them.
    tolerance_s : float
        Readings of one instant are at most this far apart. Half the period of the slowest camera
        pairs every frame.
    """

    def __init__(self, sensors: Sequence[Sensor], *, tolerance_s: float) -> None:
        if len(sensors) < 2:
            raise InputError("a group needs two sensors or more; open each with open_sensor")
        if not 0 <= tolerance_s < float("inf"):
            raise InputError(f"a tolerance of {tolerance_s:g} s? give the seconds, 0 or more")
        self.sensors = tuple(sensors)
        self.tolerance_s = tolerance_s
        self.skipped = 0

    def stream(self) -> Iterator[PairedReadings]:
        """Yield paired readings until the first sensor ends.

        The sensor that is behind is read again until all are within the tolerance. Readings without
        a partner are counted in ``skipped``.

        Raises
        ------
        DeviceError
            A camera fails.
        """
        streams = [sensor.stream() for sensor in self.sensors]
        current = [next(stream, None) for stream in streams]
        while True:
            readings = tuple(reading for reading in current if reading is not None)
            if len(readings) < len(current):
                return
            times = [reading.frame.timestamp_s for reading in readings]
            apart_s = max(times) - min(times)
            if apart_s <= self.tolerance_s:
                yield PairedReadings(readings, apart_s)
                current = [next(stream, None) for stream in streams]
            else:
                behind = times.index(min(times))
                self.skipped += 1
                current[behind] = next(streams[behind], None)

    def close(self) -> None:
        """Close every sensor, even if one of them fails."""
        with ExitStack() as stack:
            for sensor in self.sensors:
                stack.callback(sensor.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
