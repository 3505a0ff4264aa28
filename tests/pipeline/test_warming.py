"""What the first frame would wait for is loaded before the camera is open, and leaves no trace."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.live_sensor import profile, send, stream
from support.mjpeg_server import Exchange, MjpegServer

from tactile_core import ContactMask, Pipeline, open_sensor
from tactile_core.algorithms import kernels
from tactile_core.evaluation.timing.unit import VirtualUnit, virtual_unit
from tactile_core.formats.saved_quantities import arrays_of
from tactile_core.interfaces.reading import Reading
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
    pipeline = Pipeline(unit.profile, unit.bundle, compiled=False)
    assert pipeline.reference is not None
    frames = made_up_frames(pipeline.reference, unit.profile.image.mm_per_px)
    touched = [bool(pipeline.process(frame)[ContactMask].mask.any()) for frame in frames]
    assert any(one and other for one, other in pairwise(touched))
    assert not touched[0]


def compiled() -> dict[str, int]:
    """Return how many versions of each kernel are loaded."""
    dispatcher = pytest.importorskip("numba.core.dispatcher").Dispatcher
    found = (one for one in gc.get_objects() if isinstance(one, dispatcher))
    ours = (one for one in found if "tactile" in one.py_func.__module__)
    return {f"{one.py_func.__module__}.{one.__name__}": len(one.signatures) for one in ours}


def test_a_warm_pipeline_loads_no_kernel_with_its_first_frames(unit: VirtualUnit) -> None:
    if kernels.load() is None:
        pytest.skip("the extra 'fast' is not installed")
    pipeline = Pipeline(unit.profile, unit.bundle)
    pipeline.warm()
    before = compiled()
    for frame in (*unit.frames, *unit.stroke):
        pipeline.process(frame)
    assert compiled() == before


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
            assert not any("compiled" in one for one in sensor.read().warnings)


OPENED = """\
import sys
from tactile_core import open_sensor
with open_sensor(sys.argv[1], bundle=sys.argv[2]) as sensor:
    print(*sensor.notes, sep="\\n")
    print("READING", *sensor.read().warnings, sep="\\n")
"""


@pytest.mark.soak
def test_kernels_of_a_new_installation_are_compiled_before_the_first_reading(
    tmp_path: Path,
) -> None:
    pytest.importorskip("numba")
    unit = virtual_unit(load_profile("hex_fingertip"))
    unit.bundle.save(tmp_path / "bundle")
    image = bytes(cv2.imencode(".png", unit.frames[0].pixels[..., ::-1])[1])

    def answer(exchange: Exchange) -> None:
        exchange.begin()
        while not exchange.stopped.wait(0.03):
            exchange.send_image(image)

    with MjpegServer(answer) as server:
        path = tmp_path / "live.yaml"
        path.write_text(f"extends: hex_fingertip\ncamera: {stream(server.url)}\n")
        done = subprocess.run(
            [sys.executable, "-c", OPENED, path, tmp_path / "bundle"],
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=True,
        )
    notes, _, warnings = done.stdout.partition("READING")
    assert "compiled its kernels" in notes
    assert "compiled" not in warnings


def test_a_step_that_fails_with_made_up_frames_fails_only_with_real_ones(
    unit: VirtualUnit, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipeline = Pipeline(unit.profile, unit.bundle)
    monkeypatch.setattr(Pipeline, "process", lambda *_: 1 / 0)
    pipeline.warm()
    with pytest.raises(ZeroDivisionError):
        pipeline.process(unit.frames[0])
