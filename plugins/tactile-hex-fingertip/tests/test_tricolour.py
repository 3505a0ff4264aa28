from itertools import pairwise

import pytest

from tactile_core.plugins.registry import resolve
from tactile_core.profiles.loader import load_profile
from tactile_hex_fingertip.tricolour import Tricolour, TricolourOptions


def test_the_light_is_found_by_its_name() -> None:
    assert resolve("illumination", "hex_fingertip.tricolour") is Tricolour


def test_one_exposure_sees_three_channels() -> None:
    light = Tricolour(TricolourOptions())
    (exposure,) = light.exposures()
    assert exposure.channels == light.channels == ("red", "green", "blue")


def test_the_arrays_are_on_alternate_sides_of_the_hexagon() -> None:
    azimuths = [array.azimuth_deg for array in TricolourOptions().lights]
    assert [b - a for a, b in pairwise(azimuths)] == [120, 120]


def test_the_light_comes_19_degrees_above_the_gel() -> None:
    assert {array.elevation_deg for array in TricolourOptions().lights} == {19}


def test_two_arrays_with_the_same_name_are_refused() -> None:
    arrays = [{"name": "red", "azimuth_deg": a} for a in (0, 120, 240)]
    with pytest.raises(ValueError, match="different names"):
        TricolourOptions.model_validate({"lights": arrays})


def test_the_profile_has_the_papers_numbers() -> None:
    profile = load_profile("hex_fingertip")
    width_mm = profile.image.width_px * profile.image.mm_per_px
    assert width_mm == pytest.approx(17.67, abs=0.01)
    assert profile.gel.shear_modulus_mpa == 0.145
    assert profile.gel.thickness_mm == 2.0


def test_the_unmarked_tip_differs_in_its_markers_only() -> None:
    marked, unmarked = load_profile("hex_fingertip"), load_profile("hex_fingertip_unmarked")
    assert unmarked.gel.markers is None
    assert unmarked.gel == marked.gel.model_copy(update={"markers": None})
    assert unmarked.image == marked.image
    assert unmarked.illumination == marked.illumination
