"""Readings of several sensors are paired by their time."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest
from support.virtual_lab import VirtualLab

from tactile_core import open_sensor
from tactile_core.errors import InputError
from tactile_core.pipeline.opening import SensorGroup


class Clocked:
    """Stands for a sensor whose frames come at given times."""

    name = "finger"

    def __init__(self, times_s: Sequence[float], fails: bool = False) -> None:
        self.left, self.fails, self.closed = list(times_s), fails, False
        self.measured: list[float] = []

    def acquire(self) -> Any:
        return SimpleNamespace(timestamp_s=self.left.pop(0)) if self.left else None

    def measure(self, frame: Any) -> Any:
        self.measured.append(frame.timestamp_s)
        return SimpleNamespace(frame=frame)

    def close(self) -> None:
        self.closed = True
        if self.fails:
            raise OSError("stuck")


def pairs(group: SensorGroup) -> list[tuple[float, ...]]:
    return [tuple(r.frame.timestamp_s for r in pair.readings) for pair in group.stream()]


def group(*times_s: Sequence[float], tolerance_s: float = 0.1) -> SensorGroup:
    sensors: Any = [Clocked(times) for times in times_s]
    return SensorGroup(sensors, tolerance_s=tolerance_s)


def test_readings_within_the_tolerance_are_paired() -> None:
    fingers = group([0.0, 1.0, 2.0], [0.05, 0.98, 2.02])
    assert pairs(fingers) == [(0.0, 0.05), (1.0, 0.98), (2.0, 2.02)]
    assert fingers.skipped == 0


def test_a_lost_frame_of_one_sensor_shifts_no_later_pair() -> None:
    fingers = group([0.0, 1.0, 2.0, 3.0], [0.05, 2.05, 3.05])
    assert pairs(fingers) == [(0.0, 0.05), (2.0, 2.05), (3.0, 3.05)]
    assert fingers.skipped == 1
    assert [sensor.measured for sensor in fingers.sensors] == [[0.0, 2.0, 3.0], [0.05, 2.05, 3.05]]  # type: ignore[attr-defined]


def test_a_sensor_that_starts_later_is_waited_for() -> None:
    fingers = group([0.0, 1.0, 2.0], [2.0], [0.0, 2.0])
    assert pairs(fingers) == [(2.0, 2.0, 2.0)]


def test_frames_that_alternate_without_meeting_are_an_error_with_their_distance() -> None:
    fingers = group([i / 30 for i in range(99)], [(i + 0.5) / 30 for i in range(99)], tolerance_s=0)
    with pytest.raises(InputError, match=r"closest are 0\.0167 s apart, so allow a larger"):
        pairs(fingers)


def test_the_time_between_the_readings_is_reported() -> None:
    (pair,) = group([0.0], [0.06]).stream()
    assert pair.apart_s == pytest.approx(0.06)


def test_every_sensor_is_closed_although_one_fails() -> None:
    sensors: Any = [Clocked([]), Clocked([], fails=True), Clocked([])]
    with pytest.raises(OSError, match="stuck"), SensorGroup(sensors, tolerance_s=0.0):
        pass
    assert all(sensor.closed for sensor in sensors)


def test_recordings_of_two_fingers_are_paired(lab: VirtualLab) -> None:
    fingers = [
        open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) for _ in range(2)
    ]
    with SensorGroup(fingers, tolerance_s=0.01) as both:
        sources = [tuple(r.source for r in pair.readings) for pair in both.stream()]
    assert sources == [(f"press_{i}", f"press_{i}") for i in range(10)]


def test_one_sensor_is_no_group(lab: VirtualLab) -> None:
    with pytest.raises(InputError, match="two sensors"):
        group([0.0])
    with pytest.raises(InputError, match="tolerance"):
        group([0.0], [0.0], tolerance_s=-1.0)
