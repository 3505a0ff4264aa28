"""The demonstration runs for every shipped rig without hardware or files."""

import pytest

from tactile_core.profiles.loader import list_rigs, load_profile
from tactile_sim.demonstration import demonstrate


def test_rigs_do_not_include_revisions():
    names = [entry.name for entry in list_rigs()]
    assert {"hex_fingertip", "baxter_fingertip", "desktop_six_led"} <= set(names)
    assert "hex_fingertip_unmarked" not in names


@pytest.mark.parametrize("name", [entry.name for entry in list_rigs()])
def test_a_calibrated_virtual_rig_measures_other_objects(name):
    profile = load_profile(name)
    image = profile.image
    smaller = {
        "width_px": image.width_px // 2,
        "height_px": image.height_px // 2,
        "mm_per_px": 2 * image.mm_per_px,
    }
    profile = profile.model_copy(update={"image": image.model_copy(update=smaller)})
    rows, parts = demonstrate(profile)
    # half the resolution cannot resolve a cone's tip
    assert all(row.normal_error_deg < 5 for row in rows if row.press != "cone")
    assert all(row.height_error_mm < 0.12 * row.depth_mm for row in rows)
    # camera image, measured, true and error; then shear until gross slip
    pictures = [part.count("<img") for part in parts if "<img" in part]
    assert pictures[:-1] == [4] * len(rows)
    assert 2 <= pictures[-1] <= 4
    assert "gross slip" in parts[-1]
