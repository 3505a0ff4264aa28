"""Who switches the lights, and that each image shows the exposure that it should."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.errors import DeviceError, InputError, PluginFault
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure, Illumination
from tactile_core.interfaces.image import ImageSection
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.quantities import Image

NAMES = ("a", "b", "c")
IMAGE = ImageSection(width_px=8, height_px=6, mm_per_px=0.1, color="grey")


class InTurn(Illumination):
    channels = NAMES

    def exposures(self) -> tuple[Exposure, ...]:
        return tuple(Exposure({name: 1.0}, (name,)) for name in NAMES)


class Box(LightDriver):
    def __init__(self) -> None:
        super().__init__(Options())
        self.set_to: list[Mapping[str, float]] = []

    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        """Nothing to release."""

    def _set(self, levels: Mapping[str, float]) -> None:
        self.set_to.append(dict(levels))


class Scripted(Camera):
    """Sends the exposures that it is told, each as bright as its index says."""

    def __init__(self, indices: Sequence[int], trigger: Trigger, *, tells: bool = True) -> None:
        super().__init__(Options())
        self._indices, self._trigger, self._tells = iter(indices), trigger, tells
        self.armed: list[tuple[Exposure, ...]] = []

    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        """Nothing to release."""

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        self.armed.append(exposures)
        return self._trigger

    def _read(self, timeout_s: float) -> Image:
        index = next(self._indices)
        pixels = np.full((6, 8), 10 * index, np.uint8)
        return Image(pixels, exposure_index=index if self._tells else None)


def observed(camera: Camera, driver: LightDriver | None = None) -> list[int]:
    """Levels of the channels of one observation."""
    frame = Acquisition(camera.open(), InTurn(Options()), IMAGE, driver).observe()
    assert frame is not None
    return [int(level) for level in frame.pixels[0, 0]]


def test_the_driver_sets_each_light_before_its_image_is_read() -> None:
    camera, box = Scripted([0, 1, 2, 0, 1, 2], Trigger.SOFTWARE), Box()
    acquisition = Acquisition(camera.open(), InTurn(Options()), IMAGE, box.open())
    for _ in range(2):
        acquisition.observe()
    assert box.set_to == [{name: 1.0} for name in (*NAMES, *NAMES)]
    assert camera.armed == [InTurn(Options()).exposures()]


def test_lights_that_stay_as_they_are_are_set_once() -> None:
    class Always(InTurn):
        channels = ("a",)

        def exposures(self) -> tuple[Exposure, ...]:
            return (Exposure({"a": 1.0, "b": 1.0}, ("a",)),)

    camera, box = Scripted([0, 0, 0], Trigger.SOFTWARE), Box()
    acquisition = Acquisition(camera.open(), Always(Options()), IMAGE, box.open())
    for _ in range(3):
        acquisition.observe()
    assert box.set_to == [{"a": 1.0, "b": 1.0}]


def test_a_camera_that_switches_the_lights_itself_needs_no_driver_and_begins_anywhere() -> None:
    assert observed(Scripted([2, 0, 1], Trigger.CAMERA)) == [0, 10, 20]
    box = Box().open()
    assert observed(Scripted([0, 1, 2], Trigger.CAMERA), box) == [0, 10, 20]
    assert box.set_to == []


def test_images_that_do_not_know_their_exposure_are_taken_in_order() -> None:
    assert observed(Scripted([2, 0, 1], Trigger.CAMERA, tells=False)) == [20, 0, 10]


def test_lights_in_turn_that_nothing_switches_are_refused_in_one_sentence() -> None:
    with pytest.raises(InputError, match=r"3 exposures .* but .*Scripted does not switch them"):
        observed(Scripted([0, 1, 2], Trigger.SOFTWARE))


def test_an_image_of_another_light_than_shines_is_refused() -> None:
    with pytest.raises(
        DeviceError, match=r"lights of exposure 1 were on, .* an image of exposure 2"
    ):
        observed(Scripted([0, 2, 1], Trigger.SOFTWARE), Box().open())


def test_a_lost_image_spoils_one_observation_alone() -> None:
    camera = Scripted([0, 2, 0, 1, 2, 0], Trigger.CAMERA)
    acquisition = Acquisition(camera.open(), InTurn(Options()), IMAGE)
    with pytest.raises(DeviceError, match=r"exposure 0 arrived twice .* an image was lost"):
        acquisition.observe()
    frame = acquisition.observe()
    assert frame is not None
    assert [int(level) for level in frame.pixels[0, 0]] == [0, 10, 20]
    assert len(camera.armed) == 2


def test_an_exposure_that_does_not_exist_is_a_fault_of_the_camera() -> None:
    with pytest.raises(PluginFault, match="exposure_index is 7; one observation has 3"):
        observed(Scripted([7, 0, 1], Trigger.CAMERA))
