"""Sequential lights of a box at a serial port, and a camera that runs freely, in real time."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from functools import partial

import numpy as np
import pytest

if not sys.platform.startswith(("linux", "darwin")):
    pytest.skip("needs pseudo-terminals", allow_module_level=True)
pytest.importorskip("serial", reason="needs pyserial")

from support.light_box import LIGHTS, LightBox
from support.virtual_bench import (
    AMBIENT,
    BRIGHT,
    IMAGE,
    RealTime,
    Scene,
    SixLights,
    Timing,
    VirtualCamera,
)

from tactile_core.acquisition.acquisition import Acquisition, average
from tactile_core.builtin.leds.serial_leds import SerialLeds
from tactile_core.conditioning.conditioning import pattern_of, verify
from tactile_core.errors import DeviceError, SequenceError
from tactile_core.pipeline.frame_check import LiveCheck

FAST = Timing(period_s=0.02, exposure_s=0.005, readout_s=0.016, stamp_s=0.006)


class LitScene(LightBox):
    """A box whose lights a camera sees; they change before the acknowledgement.

    Attributes
    ----------
    wiring : tuple of int
        The output that each light is connected to.
    """

    wiring = (0, 1, 2, 3, 4, 5)

    def __init__(self) -> None:
        self.scene = Scene()
        super().__init__()

    def proper(self, words: tuple[str, ...]) -> bytes:
        if words[0] == "SET":
            levels = np.array([int(level) for level in words[2:]])[list(self.wiring)] / 255
            self.scene.changes.append((time.monotonic(), levels))
        return super().proper(words)


@pytest.fixture
def box() -> Iterator[LitScene]:
    box = LitScene()
    yield box
    box.unplug()


def leds(box: LightBox) -> SerialLeds:
    return SerialLeds(SerialLeds.Options(lights=LIGHTS, port=box.port, timeout_s=1.0))


def acquisition(box: LitScene, driver: SerialLeds) -> Acquisition:
    camera = VirtualCamera(RealTime(), box.scene, FAST).open()
    return Acquisition(camera, SixLights(), IMAGE, driver)


def assert_right(acquisition: Acquisition) -> None:
    frame = acquisition.observe()
    assert frame is not None
    np.testing.assert_allclose(frame.pixels.transpose(2, 0, 1), BRIGHT + AMBIENT, atol=1)


def test_every_image_shows_its_light(box: LitScene) -> None:
    with leds(box) as driver:
        lit = acquisition(box, driver)
        for _ in range(5):
            assert_right(lit)
    assert not box.scene.changes[-1][1].any()


def test_a_box_that_falls_silent_spoils_one_observation(box: LitScene) -> None:
    with leds(box) as driver:
        lit = acquisition(box, driver)
        assert_right(lit)
        sets = iter(range(99))
        box.answer = lambda words: box.proper(words) if next(sets) < 5 else b""
        with pytest.raises(DeviceError, match=r"does not answer within 1 s"):
            lit.observe()
        box.answer = box.proper
        try:
            assert_right(lit)
        except DeviceError:  # the keep-alive had failed too, and says so once
            assert_right(lit)


def test_after_a_new_plug_the_same_driver_opens_again(box: LitScene) -> None:
    with leds(box) as driver:
        lit = acquisition(box, driver)
        assert_right(lit)
        box.unplug()
        with pytest.raises(DeviceError, match="was disconnected"):
            lit.observe()
    other = LitScene()
    with leds(other) as driver:
        assert_right(acquisition(other, driver))
    other.unplug()


def test_lights_that_are_swapped_are_refused_until_they_are_right_again(box: LitScene) -> None:
    with leds(box) as driver:
        lit = acquisition(box, driver)
        first = lit.observe()
        assert first is not None
        check = LiveCheck(lit)
        right = partial(verify, expected=pattern_of(average([first])), what="the observation")
        box.wiring = (0, 4, 2, 3, 1, 5)
        with pytest.raises(SequenceError, match="light 'led2' shows light 'led5'"):
            check.observe(right, 2.0)
        box.wiring = LitScene.wiring
        assert check.observe(right, 2.0) is not None
