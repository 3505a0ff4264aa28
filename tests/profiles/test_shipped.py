"""The shipped profiles, and the example sensors that need only YAML."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.interfaces.gel import Markers
from tactile_core.profiles.loader import list_profiles, load_profile

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    "name",
    [
        "baxter_fingertip",
        "baxter_fingertip_flat",
        "baxter_fingertip_marked",
        "desktop_six_led",
        "desktop_six_led_portable",
        "desktop_three_colour",
        "hex_fingertip",
        "hex_fingertip_domed",
        "hex_fingertip_force",
        "hex_fingertip_unmarked",
    ],
)
def test_a_shipped_profile_is_valid_and_named_like_its_file(name: str) -> None:
    assert load_profile(name).name == name
    assert name in [entry.name for entry in list_profiles() if entry.origin == "shipped"]


def test_the_gel_of_2015_has_the_values_of_the_paper() -> None:
    profile = load_profile("baxter_fingertip_marked")
    gel, image = profile.gel, profile.image
    assert (gel.shape, gel.size_mm, gel.thickness_mm) == ("flat", (23.4, 22.6), 2.0)
    assert gel.shear_modulus_mpa == 0.145
    view_mm = (image.width_px * image.mm_per_px, image.height_px * image.mm_per_px)
    assert view_mm == pytest.approx((17.67, 13.25), abs=0.01)
    assert profile.calibration.use == load_profile("baxter_fingertip").calibration.use


def test_the_wedge_uses_only_the_core_plugin() -> None:
    wedge = load_profile(EXAMPLES / "wedge" / "wedge.yaml")
    assert {part.use.partition(".")[0] for part in wedge.components.values()} == {"core"}
    assert (wedge.image.width_px, wedge.image.height_px) == (240, 320)


def test_the_warp_of_the_wedge_fills_its_image() -> None:
    image = load_profile(EXAMPLES / "wedge" / "wedge.yaml").image
    assert image.warp is not None
    assert set(image.warp.target) == {
        (x, y) for x in (0, image.width_px) for y in (0, image.height_px)
    }


@pytest.mark.recordings
def test_the_markers_of_the_wedge_match_its_profile(recordings: Path) -> None:
    import cv2
    import numpy as np

    from tactile_core.acquisition.geometry import ImageGeometry
    from tactile_core.algorithms.markers.count import find_marker_lattice

    wedge = load_profile(EXAMPLES / "wedge" / "wedge.yaml")
    undeformed = cv2.imread(str(recordings / "three_colour" / "wedge" / "bg-0.jpg"))
    assert undeformed is not None
    straight = ImageGeometry(wedge.image).apply(cv2.cvtColor(undeformed, cv2.COLOR_BGR2RGB))
    found = find_marker_lattice(np.asarray(straight))
    assert found is not None
    markers = wedge.gel.markers
    assert isinstance(markers, Markers)
    diameter_mm, pitch_mm = np.multiply(found[1:], wedge.image.mm_per_px)
    assert pitch_mm == pytest.approx(markers.pitch_mm, rel=0.02)
    # measured at half contrast; the profile's diameter includes a blurred rim of a pixel per side
    assert diameter_mm < markers.diameter_mm < diameter_mm + 2 * wedge.image.mm_per_px


def test_objectfolder_has_no_markers() -> None:
    profile = load_profile(EXAMPLES / "objectfolder.yaml")
    assert profile.gel.markers is None
    assert profile.image.width_px * profile.image.mm_per_px == pytest.approx(19.9, abs=0.05)


@pytest.mark.parametrize(
    ("name", "camera", "driver"),
    [
        ("hex_fingertip", "core.uvc", None),
        ("hex_fingertip_domed", "core.uvc", None),
        ("baxter_fingertip_marked", "core.uvc", None),
        ("desktop_six_led", "genicam.camera", "core.serial_leds"),
        ("desktop_six_led_portable", "core.uvc", "core.serial_leds"),
        ("desktop_three_colour", "genicam.camera", None),
    ],
)
def test_a_shipped_profile_opens_its_device(name: str, camera: str, driver: str | None) -> None:
    profile = load_profile(name)
    assert profile.camera.use == camera
    assert getattr(profile.illumination.driver, "use", None) == driver


def test_the_virtual_sensor_needs_no_device() -> None:
    assert load_profile("desktop_six_led", sim=True).camera.use == "sim.virtual"


def test_the_light_box_has_an_output_for_each_light_of_the_rig() -> None:
    lighting = load_profile("desktop_six_led").illumination
    assert lighting.driver is not None
    names = [light["name"] for light in lighting.options["lights"]]
    assert list(lighting.driver.options["lights"]) == names
