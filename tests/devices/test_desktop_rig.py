"""The desktop rig on emulated devices: GigE camera, box of six lights, and what it measures."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

if not sys.platform.startswith("linux"):
    pytest.skip("needs pseudo-terminals and Aravis", allow_module_level=True)
pytest.importorskip("serial", reason="needs pyserial")

from support import avr_board
from support.command_line import tactile
from support.gige_camera import ADDRESS, PaintedCamera, alone, missing
from support.light_box import LIGHTS
from support.lit_gel import EmulatedShutter, LitBox, LitGel, Seen

from tactile_core.builtin.leds.led_box import encode
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.errors import SequenceError
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sensor import Sensor
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import HeightMap

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing())

SIZE = WIDTH, HEIGHT = 306, 256
IMAGE = {"width_px": WIDTH, "height_px": HEIGHT, "mm_per_px": 0.0272}
EXPOSURE_S = 0.004
BALL_MM, PRESSES = 2.0, 6
SHARES = (0.5, 1.0, 0.75, 1.25, 1.0, 0.5)
"""Exposure times of the lights, as multiples of that of the virtual rig."""

PINS = (3, 5, 6, 9, 10, 11)
"""Of the lights, at the Arduino."""

SKETCH = Path(__file__).parents[2] / "plugins/tactile-desktop-six-led/firmware/main.cpp"


@dataclass(frozen=True)
class Bench:
    """A gel under a ball, and the bundle of its rig."""

    gel: LitGel
    bundle: Path
    exact_mm: np.ndarray
    """Heights that the virtual rig alone gives."""

    def profile(self, port: str, **camera: object) -> dict[str, Any]:
        """Return what the profile needs to find the emulated devices."""
        emulated = {"address": ADDRESS, "region": [0, 0, *SIZE], "exposure_time_s": EXPOSURE_S}
        return {
            "image": IMAGE,
            "camera": emulated | camera,
            "illumination": {"driver": {"port": port, "timeout_s": 4.0}},
        }

    def camera(self, seen: Seen, **shutter: Any) -> PaintedCamera:
        """Plug the camera in."""
        paint = EmulatedShutter(self.gel, seen, 1e6 * EXPOSURE_S, **shutter)
        return PaintedCamera("RIG-1", paint, WIDTH * HEIGHT)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    folder = tmp_path_factory.mktemp("bench")
    gel = LitGel("desktop_six_led", {"image": IMAGE})
    record(folder / "undeformed", gel)
    random = np.random.default_rng(0)
    for number in range(PRESSES):
        x_mm, y_mm = random.uniform(-2.2, 2.2, 2)
        press(gel, BALL_MM, x_mm, y_mm)
        record(folder / "presses" / str(number), gel)
        gel.stage.release()
    profile = load_profile("desktop_six_led", overrides={"image": IMAGE})
    made = calibrate(
        profile, folder / "presses", folder / "undeformed", ball_diameter_mm=BALL_MM, scored=False
    )
    made.save(folder / "bundle")
    press(gel, 3.0, 0.8, -0.5)
    alone = replace(gel.stage.frame(), pixels=gel.lit)
    reading = Pipeline(profile, Bundle.load(folder / "bundle")).process(alone)
    return Bench(gel, folder / "bundle", reading[HeightMap].mm)


def press(gel: LitGel, diameter_mm: float, x_mm: float, y_mm: float) -> None:
    gel.stage.indenter("sphere", diameter_mm=diameter_mm, x_mm=x_mm, y_mm=y_mm)
    gel.stage.press(depth_mm=0.3)
    gel.render()


def record(folder: Path, gel: LitGel) -> None:
    folder.mkdir(parents=True)
    for name, pixels in zip(LIGHTS, gel.lit.transpose(2, 0, 1), strict=True):
        cv2.imwrite(str(folder / f"{name}.png"), pixels)


@pytest.fixture(autouse=True)
def _alone() -> Iterator[None]:
    with alone():
        yield


@pytest.fixture
def box() -> Iterator[LitBox]:
    box = LitBox()
    yield box
    box.unplug()


def opened(bench: Bench, overrides: dict[str, Any], **illumination: object) -> Sensor:
    overrides["illumination"] |= illumination
    profile = load_profile("desktop_six_led", overrides=overrides)
    return open_sensor(profile, bundle=bench.bundle, timeout_s=5.0)


def run(bench: Bench, profile: dict[str, Any], folder: Path) -> list[np.ndarray]:
    """Measure three observations with the command, and return the heights."""
    path = folder / "bench.yaml"
    path.write_text(
        json.dumps({"schema": 1, "name": "bench", "extends": "desktop_six_led"} | profile)
    )
    done = tactile(
        *("run", path, "--bundle", bench.bundle, "--frames", 3, "--timeout", 5),
        *("--out", folder / "out", "--json"),
    )
    assert done.returncode == 0, done.stderr
    # pictures without noise repeat, which the health of a camera that runs freely mentions
    assert "shows light" not in done.stdout
    results = sorted((folder / "out").glob("*.npz"))
    return [np.load(result)["height_mm"] for result in results]


def test_the_virtual_rig_alone_measures_the_ball(bench: Bench) -> None:
    truth = bench.gel.stage.truth()
    error_mm = bench.exact_mm - truth.height_mm
    assert np.sqrt(np.mean(error_mm[truth.contact] ** 2)) < 0.02 * truth.height_mm.max()


@pytest.mark.parametrize("trigger", ["software", "none"])
def test_over_the_wires_heights_are_those_of_the_virtual_rig_alone(
    bench: Bench, box: LitBox, tmp_path: Path, trigger: str
) -> None:
    camera = {"trigger": trigger} | ({} if trigger == "software" else {"fps": 50})
    with bench.camera(box.history.mean, triggered=trigger == "software"):
        heights = run(bench, bench.profile(box.port, **camera), tmp_path)
    for height_mm in heights:
        np.testing.assert_array_equal(height_mm, bench.exact_mm)
    assert len(heights) == 3
    assert box.levels[-1] == [0] * 6


@pytest.mark.skipif(bool(avr_board.missing()), reason=f"needs {avr_board.missing()}")
def test_with_the_very_firmware_of_the_lights_too(bench: Bench, tmp_path: Path) -> None:
    firmware = avr_board.compile_firmware(SKETCH, tmp_path / "firmware.elf")
    board = avr_board.Board(avr_board.compile_board(tmp_path / "board"), firmware)

    def seen(begin_s: float, end_s: float) -> np.ndarray:
        levels = board.look()
        return np.array([levels.get(pin, 0) for pin in PINS]) / 255

    try:
        with bench.camera(seen):
            heights = run(bench, bench.profile(board.port), tmp_path)
        assert not any(board.look().values())
    finally:
        board.close()
    for height_mm in heights:
        np.testing.assert_array_equal(height_mm, bench.exact_mm)


def test_each_light_may_have_its_own_exposure(bench: Bench, box: LitBox) -> None:
    lights = [
        {"name": name, "azimuth_deg": 0, "elevation_deg": 25, "exposure_time_s": share * EXPOSURE_S}
        for name, share in zip(LIGHTS, SHARES, strict=True)
    ]
    profile = bench.profile(box.port)
    with bench.camera(box.history.mean), opened(bench, profile, lights=lights) as sensor:
        pixels = sensor.read().frame.pixels
    for index, share in enumerate(SHARES):
        wanted = bench.gel.picture(np.eye(6)[index], share)
        np.testing.assert_array_equal(pixels[..., index], wanted)


def test_a_dark_exposure_removes_the_light_of_the_room(bench: Bench, box: LitBox) -> None:
    profile = bench.profile(box.port)
    bench.gel.stray = 20.0
    try:
        with bench.camera(box.history.mean), opened(bench, profile, dark=True) as sensor:
            reading = sensor.read()
    finally:
        bench.gel.stray = 0.0
    np.testing.assert_allclose(reading.frame.pixels.astype(int), bench.gel.lit, atol=1)
    np.testing.assert_allclose(reading[HeightMap].mm, bench.exact_mm, atol=0.02)


def test_an_observation_under_a_wrong_light_is_dropped_and_named(bench: Bench, box: LitBox) -> None:
    profile = bench.profile(box.port)
    with bench.camera(box.history.mean), opened(bench, profile) as sensor:
        assert sensor.read().warnings == ()
        sets = iter(range(99))
        box.answer = lambda words: (
            encode("OK", words[1])  # but does nothing
            if words[0] == "SET" and next(sets) == 1
            else box.proper(words)
        )
        (warning,) = sensor.read().warnings
        assert "the exposure of light 'led2' shows light 'led1'" in warning
        reading = sensor.read()
    assert reading.warnings == ()
    np.testing.assert_array_equal(reading[HeightMap].mm, bench.exact_mm)


def test_lights_that_are_wired_in_another_order_are_an_error(bench: Bench, box: LitBox) -> None:
    profile = bench.profile(box.port)
    profile["illumination"]["driver"]["lights"] = LIGHTS[::-1]
    with (
        bench.camera(box.history.mean),
        opened(bench, profile) as sensor,
        pytest.raises(SequenceError, match="names its outputs as they are wired"),
    ):
        sensor.read()
