"""Every shipped rig shows what it can do with no hardware and no files."""

import pytest

from tactile_core.profiles.loader import list_rigs, load_profile
from tactile_core.progress import Silent
from tactile_core.sim.demo import demonstrate


def test_a_rig_is_no_revision_of_another():
    names = [entry.name for entry in list_rigs()]
    assert {"hex_fingertip", "baxter_fingertip", "desktop_six_led"} <= set(names)
    assert "hex_fingertip_unmarked" not in names


@pytest.mark.parametrize("name", [entry.name for entry in list_rigs()])
def test_a_virtual_rig_is_calibrated_and_measures_other_balls(name):
    profile = load_profile(name)
    image = profile.image
    smaller = {
        "width_px": image.width_px // 2,
        "height_px": image.height_px // 2,
        "mm_per_px": 2 * image.mm_per_px,
    }
    profile = profile.model_copy(update={"image": image.model_copy(update=smaller)})
    rows, parts = demonstrate(profile, Silent())
    assert all(row.normal_error_deg < 8 for row in rows)
    assert all(row.height_error_mm < 0.12 * row.depth_mm for row in rows)
    assert sum("<img" in part for part in parts) == 3 * len(rows)
