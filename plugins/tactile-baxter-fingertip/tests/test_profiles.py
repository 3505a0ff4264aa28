import numpy as np
import pytest

from tactile_core.acquisition.devices import make_lights
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.profiles.loader import load_profile
from tactile_sim.optics.rig import render


def test_one_exposure_shows_four_arrays_in_three_channels() -> None:
    illumination = make_lights(load_profile("baxter_fingertip"))
    (exposure,) = illumination.exposures()
    assert set(exposure.levels) == {"red", "green", "blue", "white"}
    assert exposure.channels == illumination.channels == ("red", "green", "blue")
    feeds = {light.name: light.feeds for light in illumination.lights}
    assert feeds["white"] == illumination.channels
    assert feeds["red"] == ("red",)


def test_there_is_one_array_on_each_side() -> None:
    lights = make_lights(load_profile("baxter_fingertip")).lights
    assert sorted(light.azimuth_deg % 360 for light in lights) == [0, 90, 180, 270]


def test_the_profile_has_the_papers_view_and_coating() -> None:
    profile = load_profile("baxter_fingertip")
    assert profile.image.width_px * profile.image.mm_per_px == pytest.approx(18, abs=0.02)
    assert profile.gel.coating == "semi_specular"
    assert profile.gel.markers is None


def test_the_flat_tip_differs_in_its_shape_only() -> None:
    domed, flat = load_profile("baxter_fingertip"), load_profile("baxter_fingertip_flat")
    assert (domed.gel.shape, flat.gel.shape) == ("dome", "flat")
    assert flat.gel == domed.gel.model_copy(update={"shape": "flat", "radius_mm": None})
    assert flat.image == domed.image
    assert flat.illumination == domed.illumination


def test_white_is_seen_by_every_channel_of_the_virtual_tip() -> None:
    profile = load_profile("baxter_fingertip_flat")
    size = profile.image.height_px, profile.image.width_px
    ball = BallPress((320, 240), 8.0, 1.0).height_mm(size, profile.image.mm_per_px)
    image = render(profile, ball)
    assert image.shape == (*size, 3)
    # Left of the apex the gel surface tilts to the left, towards the white light.
    level = render(profile, np.zeros(size))[240, 280].astype(int)
    towards_white = image[240, 280].astype(int)
    assert (towards_white[[0, 2]] > level[[0, 2]]).all()
