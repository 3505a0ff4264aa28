"""Lights that always shine."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from tactile_core.builtin.constant_light import ConstantIllumination, ConstantOptions, LightOptions


def test_one_exposure_shows_every_channel_with_every_light_on() -> None:
    lights = (
        LightOptions(name="top", azimuth_deg=-90, elevation_deg=20),
        LightOptions(name="white", azimuth_deg=0, elevation_deg=60),
    )
    illumination = ConstantIllumination(ConstantOptions(lights=lights))
    (exposure,) = illumination.exposures()
    assert exposure.levels == {"top": 1.0, "white": 1.0}
    assert exposure.channels == illumination.channels == ("red", "green", "blue")


def test_a_grey_camera_has_one_channel() -> None:
    illumination = ConstantIllumination(ConstantOptions(channels=("grey",)))
    assert illumination.channels == ("grey",)
    with illumination:
        illumination.set(illumination.exposures()[0].levels)


@pytest.mark.parametrize("channels", [(), ("a", "b"), ("a", "b", "c", "d"), ("a", "a", "b")])
def test_channels_that_no_image_has_are_refused(channels: tuple[str, ...]) -> None:
    with pytest.raises(ValidationError, match=r"1 .grey. or 3 .colour. channels"):
        ConstantOptions(channels=channels)


def test_two_lights_of_one_name_are_refused() -> None:
    light = LightOptions(name="red", azimuth_deg=0, elevation_deg=10)
    with pytest.raises(ValidationError, match="one name"):
        ConstantOptions(lights=(light, light))
