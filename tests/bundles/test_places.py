"""Which bundle a sensor measures with if none is given."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.virtual_lab import VirtualLab

from tactile_core.bundles.places import default_place, find_place
from tactile_core.errors import CalibrationError


@pytest.fixture(autouse=True)
def _own_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))


def test_without_a_bundle_of_its_own_a_unit_has_the_starting_one(lab: VirtualLab) -> None:
    assert find_place(lab.profile, None) is None
    design = lab.profile.model_copy(update={"starting_bundle": lab.bundle})
    assert find_place(design, "0008") == lab.bundle


def test_a_units_own_bundle_replaces_the_starting_one(lab: VirtualLab) -> None:
    design = lab.profile.model_copy(update={"starting_bundle": lab.bundle})
    own = default_place(design, "0007", "G1")
    own.mkdir(parents=True)
    assert find_place(design, "0007", "G1") == own
    assert find_place(design, "0007", "G2") == lab.bundle


def test_an_inherited_starting_bundle_of_another_image_size_is_none(lab: VirtualLab) -> None:
    larger = lab.profile.image.model_copy(update={"width_px": 320})
    design = lab.profile.model_copy(update={"starting_bundle": lab.bundle, "image": larger})
    assert find_place(design, None) is None


def test_a_starting_bundle_that_is_none_is_said(lab: VirtualLab, tmp_path: Path) -> None:
    design = lab.profile.model_copy(update={"starting_bundle": tmp_path / "gone"})
    with pytest.raises(CalibrationError, match="gone is no calibration bundle"):
        find_place(design, None)
