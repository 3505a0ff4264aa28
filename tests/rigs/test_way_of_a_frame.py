"""From the camera to the slip state, a frame passes each of ten functions once."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import pytest

from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.quantities import SlipState

STATIONS = {
    "tactile_core.acquisition.acquisition": ("Acquisition.observe",),
    "tactile_sim.camera": ("VirtualCamera._read",),
    "tactile_core.acquisition.assembly": ("Assembly.frame",),
    "tactile_core.pipeline.pipeline": ("Pipeline.process",),
    "tactile_core.conditioning.conditioning": ("Conditioning.__call__",),
    "tactile_core.pipeline.chain": ("Chain.run",),
    "tactile_core.builtin.contact": (
        "MarkerDetection.estimate",
        "MarkerTracking.estimate",
        "Displacement.estimate",
    ),
    "tactile_core.builtin.slip": ("Slip.estimate",),
}
FOUND = {
    "tactile_core.algorithms.markers.contrast": ("mask_of",),
    "tactile_core.algorithms.markers.detection": ("find_markers",),
}

Calls = Counter[str]


@contextmanager
def counted(calls: Calls, functions: dict[str, tuple[str, ...]]) -> Iterator[None]:
    """Count the calls of functions while the block runs, in order of the first."""

    def noted(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            name = frame.f_code.co_qualname
            if name in functions.get(frame.f_globals.get("__name__", ""), ()):
                calls[name] += 1

    before = sys.getprofile()
    sys.setprofile(noted)
    try:
        yield
    finally:
        sys.setprofile(before)


@pytest.fixture(scope="module")
def sensor() -> Iterator[Sensor]:
    with open_sensor("hex_fingertip", sim=True, reference="first") as opened:
        opened.read()
        yield opened


def test_a_frame_passes_each_function_once_and_in_order(sensor: Sensor) -> None:
    calls = Calls()
    with counted(calls, STATIONS):
        reading = sensor.read()
    assert SlipState in reading
    assert calls == dict.fromkeys([name for names in STATIONS.values() for name in names], 1)
    assert list(calls) == [name for names in STATIONS.values() for name in names]


def test_markers_of_a_frame_are_masked_once_and_detected_once(sensor: Sensor) -> None:
    calls = Calls()
    with counted(calls, FOUND):
        sensor.read()
    assert calls == {"mask_of": 1, "find_markers": 1}


def test_markers_of_a_reference_are_masked_once_and_detected_once() -> None:
    calls = Calls()
    with counted(calls, FOUND), open_sensor("hex_fingertip", sim=True, reference="first"):
        pass
    assert calls == {"mask_of": 1, "find_markers": 1}
