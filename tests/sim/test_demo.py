"""Every shipped rig shows what it can do with no hardware and no files."""

import pytest

from tactile_core.evaluation.demo import demonstrate
from tactile_core.interfaces.progress import Silent
from tactile_core.profiles.loader import list_rigs, load_profile


def test_a_rig_is_no_revision_of_another():
    names = [entry.name for entry in list_rigs()]
    assert {"hex_fingertip", "baxter_fingertip", "desktop_six_led"} <= set(names)
    assert "hex_fingertip_unmarked" not in names


@pytest.mark.parametrize("name", [entry.name for entry in list_rigs()])
def test_a_virtual_rig_is_calibrated_and_measures_other_things(name):
    profile = load_profile(name)
    image = profile.image
    smaller = {
        "width_px": image.width_px // 2,
        "height_px": image.height_px // 2,
        "mm_per_px": 2 * image.mm_per_px,
    }
    profile = profile.model_copy(update={"image": image.model_copy(update=smaller)})
    rows, parts = demonstrate(profile, Silent())
    # a cone's tip is sharper than half the pixels tell
    assert all(row.normal_error_deg < 5 for row in rows if row.press != "cone")
    assert all(row.height_error_mm < 0.12 * row.depth_mm for row in rows)
    # camera, measured, true, error; and the skin dragged until all of it slips
    pictures = [part.count("<img") for part in parts if "<img" in part]
    assert pictures[:-1] == [4] * len(rows)
    assert 2 <= pictures[-1] <= 4
    assert "all of it slips" in parts[-1]
