"""Listing profiles, and finding the profile of a name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tactile_core.errors import ProfileError
from tactile_core.profiles.loader import list_profiles, load_profile

if TYPE_CHECKING:
    from support.own_plugins import Install

FAKES = Path(__file__).parents[1] / "fakes" / "site_packages"
VALID = """\
schema: 1
name: bench
image: {width_px: 320, height_px: 240, mm_per_px: 0.05}
"""


def test_an_unknown_name_gets_suggestions_and_a_list() -> None:
    with pytest.raises(ProfileError, match=r"did you mean 'hex_fingertip'\?.*hex_fingertip_unm"):
        load_profile("hex_fingertipp")


def test_the_name_of_a_local_file_gets_a_hint_how_to_write_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bench.yaml").write_text(VALID)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ProfileError, match=r"for the file here write 'bench\.yaml'"):
        load_profile("bench")
    assert load_profile("bench.yaml").name == "bench"


def test_profiles_of_plugins_are_listed_with_their_origin(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(FAKES)
    origins = {entry.name: entry.origin for entry in list_profiles()}
    assert origins["hex_fingertip"] == "shipped"
    assert "plugin mylab" in origins.values()


def test_a_name_provided_by_two_plugins_is_rejected(install: Install) -> None:
    for name in ("here", "there"):
        install(name, {"profiles/twice.yaml": VALID}, tactile_profiles="profiles")
    with pytest.raises(ProfileError, match="is provided by plugin here and plugin there; give its"):
        load_profile("twice")
