"""Sequential lights: one exposure per light, and optionally a dark one."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_core.acquisition.acquisition import average
from tactile_core.errors import InputError, ProfileError, SequenceError
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile

LIGHTS = 6
HEIGHT, WIDTH = 512, 612


def lit(light: int) -> np.ndarray:
    """Image of a gel surface that is brighter near its light."""
    y, x = np.mgrid[-1 : 1 : HEIGHT * 1j, -1 : 1 : WIDTH * 1j]
    azimuth = np.radians(-90 - 60 * light)
    return np.round(100 * np.exp(0.15 * (x * np.cos(azimuth) + y * np.sin(azimuth))))


def record(folder: Path, images: list[np.ndarray]) -> Path:
    folder.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f"{number}.png"), np.clip(image, 0, 255).astype(np.uint8))
    return folder


def rig(dark: bool) -> Profile:
    profile = load_profile("desktop_six_led")
    options = {**profile.illumination.model_dump(), "dark": dark}
    lights = type(profile.illumination).model_validate(options)
    return profile.model_copy(update={"illumination": lights})


def test_the_dark_exposure_is_subtracted_and_never_below_zero(tmp_path: Path) -> None:
    lights = [lit(k) for k in range(LIGHTS)]
    ambient = np.full((HEIGHT, WIDTH), 20.0)
    ambient[:10] = 200
    images = [*(image + 20 for image in lights), ambient]
    (frame,) = read_frames(rig(dark=True), record(tmp_path / "seven", images))
    assert frame.pixels.shape == (HEIGHT, WIDTH, LIGHTS)
    np.testing.assert_array_equal(frame.pixels[10:], np.dstack(lights)[10:])
    assert not frame.pixels[:10].any()
    assert len(frame.exposure_times_s) == LIGHTS


def test_saturated_pixels_stay_saturated_when_the_dark_exposure_is_subtracted(
    tmp_path: Path,
) -> None:
    lights = [lit(k) + 20 for k in range(LIGHTS)]
    for image in lights:
        image[100:200, 100:300] = 255
    ambient = np.full((HEIGHT, WIDTH), 20.0)
    profile = rig(dark=True)
    (frame,) = read_frames(profile, record(tmp_path / "seven", [*lights, ambient]))
    assert frame.saturated[100:200, 100:300].all()
    assert np.count_nonzero(frame.saturated) == 100 * 200 * LIGHTS
    reading = Pipeline(profile, reference=average([frame])).process(frame)
    assert any("saturated" in warning for warning in reading.warnings)


def test_a_swapped_exposure_is_named_and_not_measured(tmp_path: Path) -> None:
    lights = [lit(k) for k in range(LIGHTS)]
    profile = rig(dark=False)
    (frame,) = read_frames(profile, record(tmp_path / "flat", lights))
    pipeline = Pipeline(profile, reference=average([frame]))
    pipeline.process(frame)
    lights[1], lights[4] = lights[4], lights[1]
    (bad,) = read_frames(profile, record(tmp_path / "press7", lights))
    with pytest.raises(SequenceError, match=r"press7.*'led2' shows light 'led5'") as caught:
        pipeline.process(bad)
    assert caught.value.exit_code == 2


# One colour of a colour image measures a coloured light


COLOURED = """\
schema: 1
name: coloured
image: {{width_px: 4, height_px: 3, mm_per_px: 0.1, transfer: linear, color: {color}}}
illumination:
  use: core.sequential
  dark: {dark}
  lights:
    - {{name: left, color: blue, azimuth_deg: 180, elevation_deg: 20}}
    - {{name: right, color: red, azimuth_deg: 0, elevation_deg: 20}}
    - {{name: top, color: {top}, azimuth_deg: -90, elevation_deg: 20}}
"""


def coloured(folder: Path, *, color: str = "rgb", dark: bool = False, top: str = "red") -> Profile:
    (folder / "coloured.yaml").write_text(
        COLOURED.format(color=color, dark=str(dark).lower(), top=top)
    )
    return load_profile(folder / "coloured.yaml")


def even(red: int, green: int, blue: int) -> np.ndarray:
    """Image of 4 × 3, as OpenCV writes it."""
    return np.full((3, 4, 3), (blue, green, red), np.uint8)


def test_each_light_is_measured_by_its_own_colour(tmp_path: Path) -> None:
    images = [even(1, 2, 103), even(104, 5, 6), even(107, 8, 9)]
    (frame,) = read_frames(coloured(tmp_path), record(tmp_path / "three", images))
    assert frame.channels == ("left", "right", "top")
    assert frame.pixels[0, 0].tolist() == [103, 104, 107]


def test_ambient_light_is_subtracted_colour_by_colour(tmp_path: Path) -> None:
    images = [even(1, 2, 103), even(104, 5, 6), even(107, 8, 9), even(40, 30, 20)]
    profile = coloured(tmp_path, dark=True)
    (frame,) = read_frames(profile, record(tmp_path / "four", images))
    assert frame.pixels[0, 0].tolist() == [83, 64, 67]


def test_a_grey_image_is_that_of_the_lights_colour(tmp_path: Path) -> None:
    images = [np.full((3, 4), level, np.uint8) for level in (50, 60, 70)]
    (frame,) = read_frames(coloured(tmp_path), record(tmp_path / "grey", images))
    assert frame.pixels[0, 0].tolist() == [50, 60, 70]


def test_a_colour_needs_colour_images(tmp_path: Path) -> None:
    images = record(tmp_path / "three", [even(1, 2, 103)] * 3)
    with pytest.raises(InputError, match=r"image\.color: rgb"):
        list(read_frames(coloured(tmp_path, color="luma"), images))


def test_every_light_has_a_colour_or_none(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="give every light one, or none"):
        coloured(tmp_path, top="null")
