"""Switching of sequential lights, and the match between images and exposures."""

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


class Sequential(Illumination):
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
    """Sends the given exposures, each with a grey level of ten times its index."""

    def __init__(self, indices: Sequence[int], trigger: Trigger, *, indexed: bool = True) -> None:
        super().__init__(Options())
        self._indices, self._trigger, self._indexed = iter(indices), trigger, indexed
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
        return Image(pixels, exposure_index=index if self._indexed else None)


def observed(camera: Camera, driver: LightDriver | None = None) -> list[int]:
    """Return the grey levels of the channels of one observation."""
    frame = Acquisition(camera.open(), Sequential(Options()), IMAGE, driver).observe()
    assert frame is not None
    return [int(level) for level in frame.pixels[0, 0]]


def test_the_driver_sets_each_light_before_reading_its_image() -> None:
    camera, box = Scripted([0, 1, 2, 0, 1, 2], Trigger.SOFTWARE), Box()
    acquisition = Acquisition(camera.open(), Sequential(Options()), IMAGE, box.open())
    for _ in range(2):
        acquisition.observe()
    assert box.set_to == [{name: 1.0} for name in (*NAMES, *NAMES)]
    assert camera.armed == [Sequential(Options()).exposures()]


def test_unchanged_lights_are_set_once() -> None:
    class Constant(Sequential):
        channels = ("a",)

        def exposures(self) -> tuple[Exposure, ...]:
            return (Exposure({"a": 1.0, "b": 1.0}, ("a",)),)

    camera, box = Scripted([0, 0, 0], Trigger.SOFTWARE), Box()
    acquisition = Acquisition(camera.open(), Constant(Options()), IMAGE, box.open())
    for _ in range(3):
        acquisition.observe()
    assert box.set_to == [{"a": 1.0, "b": 1.0}]


def test_a_camera_that_switches_the_lights_can_start_at_any_exposure() -> None:
    assert observed(Scripted([2, 0, 1], Trigger.CAMERA)) == [0, 10, 20]
    box = Box().open()
    assert observed(Scripted([0, 1, 2], Trigger.CAMERA), box) == [0, 10, 20]
    assert box.set_to == []


def test_images_without_an_exposure_index_are_used_in_order() -> None:
    assert observed(Scripted([2, 0, 1], Trigger.CAMERA, indexed=False)) == [20, 0, 10]


def test_sequential_lights_without_a_driver_are_rejected() -> None:
    with pytest.raises(InputError, match=r"3 exposures .* but .*Scripted does not switch them"):
        observed(Scripted([0, 1, 2], Trigger.SOFTWARE))


def test_an_image_of_the_wrong_exposure_is_rejected() -> None:
    with pytest.raises(
        DeviceError, match=r"lights of exposure 1 were on, .* an image of exposure 2"
    ):
        observed(Scripted([0, 2, 1], Trigger.SOFTWARE), Box().open())


def test_a_lost_image_affects_only_one_observation() -> None:
    camera = Scripted([0, 2, 0, 1, 2, 0], Trigger.CAMERA)
    acquisition = Acquisition(camera.open(), Sequential(Options()), IMAGE)
    with pytest.raises(DeviceError, match=r"exposure 0 arrived twice .* an image was lost"):
        acquisition.observe()
    frame = acquisition.observe()
    assert frame is not None
    assert [int(level) for level in frame.pixels[0, 0]] == [0, 10, 20]
    assert len(camera.armed) == 2


def test_an_invalid_exposure_index_is_a_fault_of_the_camera_plugin() -> None:
    with pytest.raises(PluginFault, match="exposure_index is 7; one observation has 3"):
        observed(Scripted([7, 0, 1], Trigger.CAMERA))
