"""What the first frame would wait for is loaded before the camera is open, and leaves no trace."""

from __future__ import annotations

import threading
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from support.live_sensor import profile, send, stream
from support.mjpeg_server import Exchange, MjpegServer

from tactile_core import ContactMask, Pipeline, open_sensor
from tactile_core.calibration.virtual_unit import VirtualUnit, virtual_unit
from tactile_core.formats.npz import arrays_of
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.made_up_frames import made_up_frames
from tactile_core.profiles.loader import load_profile

RIGS = ("hex_fingertip", "desktop_six_led_portable")


@pytest.fixture(scope="module", params=RIGS)
def unit(request: pytest.FixtureRequest) -> VirtualUnit:
    return virtual_unit(load_profile(request.param), size_px=(160, 120))


def everything(reading: Reading) -> dict[str, bytes]:
    """Return all that a reading says, but for the time that it took."""
    arrays = arrays_of(list(reading.quantities.values()), mm_per_px=reading.frame.mm_per_px)
    said = {name: np.asarray(array).tobytes() for name, array in arrays.items()}
    line = {**reading.summary(), "latency_ms": None}
    return {**said, "line": repr(line).encode()}


def test_warming_changes_no_result_and_no_state(unit: VirtualUnit) -> None:
    cold, warmed = (Pipeline(unit.profile, unit.bundle) for _ in range(2))
    warmed.warm()
    for number, frame in enumerate((*unit.frames[:2], *unit.stroke)):
        if number == 3:
            for one in (cold, warmed):
                one.tare()
        if number in (1, 3, 4):  # before, with and after a tare
            warmed.warm()
        readings = [one.process(frame) for one in (cold, warmed)]
        assert everything(readings[0]) == everything(readings[1])


def test_made_up_frames_show_a_contact_whichever_way_the_lights_come_from(
    unit: VirtualUnit,
) -> None:
    pipeline = Pipeline(unit.profile, unit.bundle)
    assert pipeline.reference is not None
    frames = made_up_frames(pipeline.reference, unit.profile.image.mm_per_px)
    touched = [bool(pipeline.process(frame)[ContactMask].mask.any()) for frame in frames]
    assert any(one and other for one, other in pairwise(touched))
    assert not touched[0]


def test_a_live_sensor_is_warm_before_its_camera_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    asked = threading.Event()

    def answer(exchange: Exchange) -> None:
        order.append("camera")
        asked.set()
        send(exchange)

    process = Pipeline.process

    def noted(self: Pipeline, *args: object, **options: object) -> Reading:
        order.append("measured")
        return process(self, *args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Pipeline, "process", noted)
    with MjpegServer(answer) as server:
        path = profile(tmp_path, stream(server.url))
        with open_sensor(path, reference="first") as sensor:
            assert asked.wait(10)
            assert order[0] == "measured"
            assert set(order[order.index("camera") :]) == {"camera"}
            sensor.read()


def test_a_step_that_fails_with_made_up_frames_fails_only_with_real_ones(
    unit: VirtualUnit, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipeline = Pipeline(unit.profile, unit.bundle)
    monkeypatch.setattr(Pipeline, "process", lambda *_: 1 / 0)
    pipeline.warm()
    with pytest.raises(ZeroDivisionError):
        pipeline.process(unit.frames[0])
