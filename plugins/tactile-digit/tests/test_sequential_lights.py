"""A DIGIT whose colours are lit one after another: the right LED in each image, and the rate."""

from __future__ import annotations

import numpy as np
import pytest
from support.virtual_bench import COLUMNS, ROWS, Scene, Timing, VirtualCamera, VirtualTime

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.acquisition.devices import make_devices
from tactile_core.interfaces.image import ImageSection
from tactile_core.profiles.loader import load_profile

DIGIT = load_profile("digit_sequential")
IMAGE = ImageSection(width_px=COLUMNS, height_px=ROWS, mm_per_px=0.1, color="rgb")


class ColourScene:
    """What the three LEDs did, each in its own colour of the image."""

    def __init__(self) -> None:
        self.colours = Scene(), Scene(), Scene()

    def switch(self, time_s: float, levels: np.ndarray) -> None:
        for number, (scene, level) in enumerate(zip(self.colours, levels, strict=True)):
            lit = np.zeros(6)
            lit[2 * number] = level
            scene.changes.append((time_s, lit))

    def picture(self, begin_s: np.ndarray, exposure_s: float) -> np.ndarray:
        return np.stack([scene.picture(begin_s, exposure_s) for scene in self.colours], -1)


class EmulatedDigit(VirtualCamera):
    """A free-running camera whose zoom sets its LEDs, some time after it was acknowledged."""

    def __init__(self, time: VirtualTime, exposure_s: float, late_s: float) -> None:
        self.scene, self._late_leds_s = ColourScene(), late_s
        timing = Timing(exposure_s=exposure_s, stamp_s=exposure_s + 0.001)
        super().__init__(time, self.scene, timing)  # type: ignore[arg-type]

    def set_control(self, name: str, value: int) -> int:
        assert name == "zoom"
        levels = np.array([value >> 8 & 15, value >> 4 & 15, value & 15]) / 15
        self.scene.switch(self._time.now_s + self._late_leds_s, levels)
        return min(value, 255)


@pytest.mark.parametrize(
    ("exposure_s", "late_s", "least_hz"),
    [(0.01, 0.0, 4.9), (0.03, 0.0, 3.3), (0.01, 0.03, 3.3), (0.03, 0.06, 2.3)],
)
def test_each_channel_shows_its_own_led_however_late_the_leds_switch(
    exposure_s: float, late_s: float, least_hz: float
) -> None:
    time, made = VirtualTime(), make_devices(DIGIT)
    assert made.driver is not None
    camera = EmulatedDigit(time, exposure_s, late_s)
    made.driver.attach(camera)
    with camera, made.driver:
        acquisition = Acquisition(camera, made.illumination, IMAGE, made.driver, clock=time.clock)
        acquisition.arm()
        began_s = time.now_s
        frames = [acquisition.observe() for _ in range(20)]
        rate_hz = 20 / (time.now_s - began_s)
    lit = ColourScene()
    lit.switch(0.0, np.ones(3))
    expected = lit.picture(np.full(ROWS, 1.0), exposure_s).astype(float)
    for frame in frames:
        assert frame is not None
        np.testing.assert_allclose(frame.pixels, expected, atol=1)
    assert rate_hz > least_hz
