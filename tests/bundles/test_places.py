"""Which bundle a sensor measures with if none is given."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.virtual_lab import VirtualLab

from tactile_core.bundles.bundle import Bundle
from tactile_core.bundles.manifest import Starting
from tactile_core.bundles.places import default_place, find_place
from tactile_core.errors import CalibrationError
from tactile_core.profiles.model import Profile


@pytest.fixture
def start(lab: VirtualLab, tmp_path: Path) -> Path:
    own = Bundle.load(lab.bundle)
    manifest = own.manifest.model_copy(update={"starting": Starting(of="virtual units")})
    Bundle(manifest, own.artefacts, None).save(tmp_path / "start")
    return tmp_path / "start"


@pytest.fixture(autouse=True)
def _own_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))


def test_without_a_bundle_of_its_own_a_unit_has_the_starting_one(
    lab: VirtualLab, start: Path
) -> None:
    assert find_place(lab.profile, None) is None
    design = lab.profile.model_copy(update={"starting_bundle": start})
    assert find_place(design, "0008") == start


def test_a_units_own_bundle_replaces_the_starting_one(lab: VirtualLab, start: Path) -> None:
    design = lab.profile.model_copy(update={"starting_bundle": start})
    own = default_place(design, "0007", "G1")
    own.mkdir(parents=True)
    assert find_place(design, "0007", "G1") == own
    assert find_place(design, "0007", "G2") == start


def test_an_inherited_starting_bundle_of_another_image_size_is_none(
    lab: VirtualLab, start: Path
) -> None:
    larger = lab.profile.image.model_copy(update={"width_px": 320})
    design = lab.profile.model_copy(update={"starting_bundle": start, "image": larger})
    assert find_place(design, None) is None


def test_a_starting_bundle_that_is_none_is_said(lab: VirtualLab, tmp_path: Path) -> None:
    design = lab.profile.model_copy(update={"starting_bundle": tmp_path / "gone"})
    with pytest.raises(CalibrationError, match=r"'starting_bundle' .*gone, which cannot be used"):
        find_place(design, None)


def test_a_profile_that_turns_the_image_has_no_inherited_starting_bundle(
    lab: VirtualLab, start: Path
) -> None:
    turned = lab.profile.image.model_copy(update={"rotate_deg": 180})
    assert find_place(_with(lab.profile, start, image=turned), None) is None


def test_the_bundle_of_a_unit_is_no_starting_one(lab: VirtualLab) -> None:
    with pytest.raises(CalibrationError, match="the bundle of one unit"):
        find_place(_with(lab.profile, lab.bundle), None)


def _with(profile: Profile, start: Path, **changes: object) -> Profile:
    return profile.model_copy(update={"starting_bundle": start, **changes})
