"""Images that another program recorded, with a profile that says how the camera sends them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.virtual_lab import VirtualLab

from tactile_core.formats.images import write_png
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.playback import played_back
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile

CAMERA = {"use": "core.uvc", "width_px": 640, "height_px": 480}
CROP = [80, 60, 480, 360]


def profile(lab: VirtualLab, camera: dict[str, Any] | None = None, **image: Any) -> Profile:
    return load_profile(
        lab.profile_path, overrides={"camera": camera or CAMERA, "image": {"crop": CROP} | image}
    )


def recorded(folder: Path, width: int, height: int) -> Path:
    folder.mkdir(exist_ok=True)
    write_png(folder / "0.png", np.full((height, width, 3), 90, np.uint8))
    return folder


def test_images_of_the_rectified_size_are_cropped_and_turned_already(
    lab: VirtualLab, tmp_path: Path
) -> None:
    read = played_back(profile(lab, rotate_deg=180), recorded(tmp_path, 160, 120))
    assert (read.profile.image.crop, read.profile.image.rotate_deg) == (None, 0)
    (note,) = read.notes
    assert "not of the camera's 640 × 480, so they are taken as cropped and turned" in note


def test_images_as_the_camera_sends_them_are_cropped(lab: VirtualLab, tmp_path: Path) -> None:
    read = played_back(profile(lab), recorded(tmp_path, 640, 480))
    assert read.profile.image == profile(lab).image
    assert read.notes == ()


@pytest.mark.parametrize(
    "camera", [{"use": "core.uvc"}, CAMERA | {"width_px": 160, "height_px": 120}]
)
def test_the_profile_stands_where_the_size_of_an_image_says_nothing(
    lab: VirtualLab, tmp_path: Path, camera: dict[str, Any]
) -> None:
    turned = profile(lab, camera, crop=None, rotate_deg=180)
    read = played_back(turned, recorded(tmp_path, 160, 120))
    assert read.profile.image.rotate_deg == 180


def test_what_is_recorded_of_such_images_is_played_by_the_same_profile(
    lab: VirtualLab, tmp_path: Path
) -> None:
    cropped = profile(lab)
    images = recorded(tmp_path / "images", 160, 120)
    with (
        open_sensor(cropped, input=images, reference="first") as sensor,
        sensor.record(tmp_path / "again.mcap", waits=True),
    ):
        first = sensor.read()
    with open_sensor(cropped, input=tmp_path / "again.mcap") as sensor:
        np.testing.assert_array_equal(sensor.read().frame.pixels, first.frame.pixels)
    assert not any("have changed" in note for note in sensor.notes)
