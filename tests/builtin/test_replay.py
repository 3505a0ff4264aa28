"""A recording in place of a camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.builtin.sequential import ReplayCamera, ReplayOptions
from tactile_core.errors import DeviceError, InputError
from tactile_core.formats.images import write_png
from tactile_core.profiles.loader import load_profile


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for i in range(3):
        write_png(tmp_path / f"press_{i}.png", np.full((4, 5, 3), i, np.uint8))
    return tmp_path


def test_images_are_delivered_in_order_and_then_none(folder: Path) -> None:
    with ReplayCamera(ReplayOptions(path=folder)) as camera:
        images = [camera.read() for _ in range(3)]
        assert [image.source for image in images if image] == ["press_0", "press_1", "press_2"]
        assert [image.sequence for image in images if image] == [0, 1, 2]
        assert camera.read() is None
        assert camera.read() is None


def test_pixels_cannot_be_written_to(folder: Path) -> None:
    with ReplayCamera(ReplayOptions(path=folder)) as camera:
        image = camera.read()
        assert image is not None
        with pytest.raises(ValueError, match="read-only"):
            image.pixels[0] = 0


def test_reopening_restarts_the_recording(folder: Path) -> None:
    camera = ReplayCamera(ReplayOptions(path=folder))
    for _ in range(2):
        with camera:
            first = camera.read()
            assert first is not None
            assert first.source == "press_0"


def test_a_loop_continues_numbers_and_times(folder: Path) -> None:
    with ReplayCamera(ReplayOptions(path=folder, loop=True)) as camera:
        images = [image for _ in range(7) if (image := camera.read()) is not None]
    assert [image.source[-1] for image in images] == list("0120120")
    assert [image.sequence for image in images] == list(range(7))
    np.testing.assert_allclose([image.timestamp_s for image in images], np.arange(7) / 30)


def test_without_a_recording_the_error_names_the_option() -> None:
    camera = ReplayCamera(ReplayOptions())
    with pytest.raises(InputError, match="--input"):
        camera.open()
    assert not camera.is_open


def test_an_unusable_recording_is_refused_on_opening(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="empty"):
        ReplayCamera(ReplayOptions(path=tmp_path)).open()


def test_a_closed_camera_does_not_play(folder: Path) -> None:
    with pytest.raises(DeviceError, match="closed"):
        ReplayCamera(ReplayOptions(path=folder)).read()


def test_a_light_driver_without_a_camera_to_pair_is_refused_with_what_to_do() -> None:
    rig = load_profile("desktop_six_led")
    with pytest.raises(InputError, match=r"light driver.*name the camera in 'camera'.*--input"):
        ReplayCamera.for_build(ReplayOptions(), rig).open()


def test_a_recording_needs_no_lights(folder: Path) -> None:
    rig = load_profile("desktop_six_led")
    with ReplayCamera.for_build(ReplayOptions(path=folder), rig) as camera:
        assert camera.read() is not None
