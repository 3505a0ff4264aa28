"""Sequential lights on a virtual clock: every image shows its light, and the rates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support import virtual_bench
from support.virtual_bench import (
    AMBIENT,
    BRIGHT,
    IMAGE,
    LIGHTS,
    SixLights,
    Timing,
    TriggeredCamera,
    VirtualCamera,
    VirtualLights,
    VirtualTime,
)

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.errors import CameraTimeout, DeviceError, InputError
from tactile_core.interfaces.illumination import Exposure
from tactile_core.quantities import Frame, Image

WEBCAM = Timing()
GLOBAL = Timing(rolling=False)
SLOW_TRANSFER = Timing(transfer_s=0.030)
STAMPED_AT_ARRIVAL = Timing(stamp_s=0.048, jitter_s=0.003)
STAMPED_AT_BEGINNING = Timing(stamp_s=0.0)
LONG_EXPOSURE = Timing(exposure_s=0.030, stamp_s=0.031)
HALF_RATE = Timing(period_s=1 / 15, readout_s=0.06)
CAMERAS = {
    "webcam": WEBCAM,
    "global shutter": GLOBAL,
    "slow transfer": SLOW_TRANSFER,
    "stamped at arrival": STAMPED_AT_ARRIVAL,
    "stamped at the beginning": STAMPED_AT_BEGINNING,
    "long exposure": LONG_EXPOSURE,
    "15 Hz": HALF_RATE,
}


class Bench:
    """A camera, six lights and their acquisition, on one virtual clock."""

    def __init__(self, timing: Timing = WEBCAM, *, dark: bool = False, **options: Any) -> None:
        self.time = VirtualTime()
        self.lights = VirtualLights(self.time).open()
        self.camera: Any = VirtualCamera(self.time, self.lights.scene, timing, **options)
        self.acquisition = self.acquire(SixLights(dark=dark))

    def acquire(self, illumination: SixLights) -> Acquisition:
        return Acquisition(
            self.camera.open(), illumination, IMAGE, self.lights, clock=self.time.clock
        )

    def observed(self) -> Frame:
        frame = self.acquisition.observe()
        assert frame is not None
        return frame

    def rate(self, count: int = 30) -> float:
        """Observations per second, each of them right."""
        self.acquisition.arm()
        self.observed()
        began_s = self.time.now_s
        for _ in range(count):
            assert_right(self.observed())
        return count / (self.time.now_s - began_s)


def assert_right(frame: Frame, ambient: float = AMBIENT) -> None:
    """Each channel shows its own light, in every row."""
    expected = np.rint(BRIGHT + AMBIENT) - (AMBIENT - ambient)
    np.testing.assert_allclose(frame.pixels.transpose(2, 0, 1), expected, atol=1)


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("knows", [True, False], ids=["delay known", "delay measured"])
def test_every_image_shows_its_light(camera: str, knows: bool) -> None:
    assert Bench(CAMERAS[camera], knows=knows).rate() > 0.8


def test_a_measured_stamp_delay_covers_the_jitter() -> None:
    """An image that was stamped early while it was measured may be stamped late from then on."""
    bench = Bench(STAMPED_AT_ARRIVAL, knows=False)
    bench.acquisition.arm()
    delay_s = bench.acquisition.stamp_delay_s
    assert delay_s is not None
    assert delay_s > STAMPED_AT_ARRIVAL.stamp_s + 2 * STAMPED_AT_ARRIVAL.jitter_s


@pytest.mark.parametrize(
    "camera", ["webcam", "global shutter", "stamped at arrival", "stamped at the beginning"]
)
@pytest.mark.parametrize("knows", [True, False], ids=["delay known", "delay measured"])
def test_six_lights_at_30_hz_without_a_trigger_give_two_observations_a_second(
    camera: str, knows: bool
) -> None:
    assert Bench(CAMERAS[camera], knows=knows).rate() >= 2


@pytest.mark.parametrize(
    ("dark", "overlaps", "rate"),
    [(False, False, 4.5), (True, False, 3.8), (False, True, 4.9), (True, True, 4.2)],
)
def test_the_rates_with_a_trigger(dark: bool, overlaps: bool, rate: float) -> None:
    bench = Bench()
    timing = replace(GLOBAL, readout_s=1 / 30 - GLOBAL.exposure_s)
    bench.camera = TriggeredCamera(bench.time, bench.lights.scene, timing, overlaps=overlaps)
    bench.acquisition = bench.acquire(SixLights(dark=dark))
    began_s = bench.time.now_s
    for _ in range(20):
        assert_right(bench.observed(), 0.0 if dark else AMBIENT)
    assert 20 / (bench.time.now_s - began_s) >= rate


def test_images_that_waited_in_a_buffer_do_not_count() -> None:
    bench = Bench()
    bench.observed()
    bench.time.sleep(7.3)
    assert_right(bench.observed())


def test_a_camera_that_does_not_report_its_exposure_time_is_slower_but_right() -> None:
    bench = Bench()
    bench.camera.reports = False
    assert bench.rate(5) > 1


def test_lights_that_change_the_image_too_little_leave_the_delay_unknown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = Bench()
    monkeypatch.setattr(virtual_bench, "BRIGHT", BRIGHT / 100)
    bench.acquisition.arm()
    monkeypatch.undo()
    assert bench.acquisition.stamp_delay_s is None
    assert 1 < bench.rate(5) < 2


def test_a_constant_light_is_on_in_the_first_image() -> None:
    class Constant(SixLights):
        channels = ("led1",)

        def exposures(self) -> tuple[Exposure, ...]:
            return (Exposure({"led1": 1.0}, ("led1",)),)

    bench = Bench()
    bench.time.sleep(2)
    bench.acquisition = bench.acquire(Constant())
    for _ in range(3):
        np.testing.assert_allclose(bench.observed().pixels[..., 0], BRIGHT[0] + AMBIENT, atol=1)


def test_each_light_has_its_own_exposure_time() -> None:
    bench = Bench()
    times_s = dict(zip(LIGHTS, (0.004, 0.008, 0.012, 0.016, 0.020, 0.024), strict=True))
    bench.acquisition = Acquisition(
        bench.camera.open(),
        SixLights(times_s=times_s),
        IMAGE,
        bench.lights,
        keep_raw=True,
        clock=bench.time.clock,
    )
    for _ in range(3):
        frame = bench.observed()
        assert [image.exposure_time_s for image in frame.raw] == list(times_s.values())
        assert_right(frame)


def test_a_box_that_falls_silent_in_a_sequence_spoils_one_observation() -> None:
    bench = Bench()
    bench.observed()
    bench.lights.silent = True
    for _ in range(2):
        with pytest.raises(DeviceError, match="the light box does not answer"):
            bench.observed()
    bench.lights.silent = False
    assert_right(bench.observed())


def test_a_camera_that_stops_is_a_timeout(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench()
    bench.observed()
    monkeypatch.setattr(bench.camera, "_arrival_s", lambda: float("inf"))
    began_s = bench.time.now_s
    with pytest.raises(CameraTimeout):
        bench.acquisition.observe(timeout_s=0.5)
    assert bench.time.now_s - began_s < 0.6
    monkeypatch.undo()
    assert_right(bench.observed())


def test_a_rate_that_leaves_too_little_time_is_a_timeout() -> None:
    bench = Bench()
    bench.acquisition.arm()
    with pytest.raises(CameraTimeout, match="no image"):
        bench.acquisition.observe(timeout_s=0.02)


@pytest.mark.parametrize(
    ("stamp", "message"),
    [
        (lambda image: 0.0, "do not increase"),
        (lambda image: image.timestamp_s - 1e6, "not of the host's monotonic clock"),
    ],
)
def test_timestamps_of_another_clock_are_an_error(
    monkeypatch: pytest.MonkeyPatch, stamp: Callable[[Image], float], message: str
) -> None:
    bench = Bench()
    read = bench.camera._read
    monkeypatch.setattr(
        bench.camera,
        "_read",
        lambda timeout_s: replace(image := read(timeout_s), timestamp_s=stamp(image)),
    )
    with pytest.raises(DeviceError, match=message):
        bench.observed()


def test_a_free_running_camera_without_lights_to_switch_is_read_as_it_comes() -> None:
    class Ring(SixLights):
        channels = ("white",)

        def exposures(self) -> tuple[Exposure, ...]:
            return (Exposure({"white": 1.0}, ("white",)),)

    bench = Bench()
    acquisition = Acquisition(bench.camera.open(), Ring(), IMAGE, clock=bench.time.clock)
    frames = [acquisition.observe() for _ in range(3)]
    assert [frame is not None and frame.sequence for frame in frames] == [0, 1, 2]
    with pytest.raises(InputError, match="name a light driver"):
        Acquisition(bench.camera, SixLights(), IMAGE, clock=bench.time.clock).arm()
