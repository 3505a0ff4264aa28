"""Constant illumination: lights that are always on."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from tactile_core.interfaces.gel import LightBuild
from tactile_core.interfaces.illumination import (
    ConstantIllumination,
    ConstantLightOptions,
    ConstantOptions,
    Light,
)


def test_one_exposure_has_every_channel_with_every_light_on() -> None:
    lights = (
        ConstantLightOptions(name="top", azimuth_deg=-90, elevation_deg=20),
        ConstantLightOptions(name="white", azimuth_deg=0, elevation_deg=60),
    )
    illumination = ConstantIllumination(ConstantOptions(lights=lights))
    (exposure,) = illumination.exposures()
    assert exposure.levels == {"top": 1.0, "white": 1.0}
    assert exposure.channels == illumination.channels == ("red", "green", "blue")


def test_a_grey_camera_has_one_channel() -> None:
    illumination = ConstantIllumination(ConstantOptions(channels=("grey",)))
    assert illumination.channels == ("grey",)


@pytest.mark.parametrize("channels", [(), ("a", "b"), ("a", "b", "c", "d"), ("a", "a", "b")])
def test_invalid_channels_are_rejected(channels: tuple[str, ...]) -> None:
    with pytest.raises(ValidationError, match=r"1 channel .grey. or 3 different channels"):
        ConstantOptions(channels=channels)


def test_two_lights_with_the_same_name_are_rejected() -> None:
    light = ConstantLightOptions(name="red", azimuth_deg=0, elevation_deg=10)
    with pytest.raises(ValidationError, match="the same name"):
        ConstantOptions(lights=(light, light))


def test_lights_have_the_direction_and_build_of_the_profile() -> None:
    options = ConstantOptions.model_validate(
        {"lights": [{"name": "red", "azimuth_deg": 90, "elevation_deg": 20, "array": [2, 4]}]}
    )
    built = LightBuild.model_validate({"array": [2, 4]})
    assert ConstantIllumination(options).lights == (Light("red", 90, 20, (), built),)


@pytest.mark.parametrize(
    ("feeds", "message"),
    [
        ([["red"], ["green"], ["blue"], ["violet"]], "'violet', which is not one of the channels"),
        ([["red"], ["red"], ["green"], ["green"]], "no light feeds blue"),
    ],
)
def test_every_channel_needs_a_light(feeds: list[list[str]], message: str) -> None:
    lights = [
        {"name": f"a{i}", "azimuth_deg": 90 * i, "elevation_deg": 20, "feeds": channels}
        for i, channels in enumerate(feeds)
    ]
    with pytest.raises(ValidationError, match=message):
        ConstantOptions.model_validate({"lights": lights})
