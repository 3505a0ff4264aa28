"""Sequential lights on a virtual clock: every image shows its light, and the rates."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.virtual_bench import (
    AMBIENT,
    BRIGHT,
    IMAGE,
    SixLights,
    Timing,
    TriggeredCamera,
    VirtualCamera,
    VirtualLights,
    VirtualTime,
)

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.quantities import Frame

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
        self.camera: Any = VirtualCamera(self.time, self.lights, timing, **options)
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
    bench.camera = TriggeredCamera(bench.time, bench.lights, timing, overlaps=overlaps)
    bench.acquisition = bench.acquire(SixLights(dark=dark))
    began_s = bench.time.now_s
    for _ in range(20):
        assert_right(bench.observed(), 0.0 if dark else AMBIENT)
    assert 20 / (bench.time.now_s - began_s) >= rate
