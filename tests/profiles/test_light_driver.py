"""The light driver is a separate component within the illumination."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.errors import ProfileError
from tactile_core.interfaces.component import Component
from tactile_core.profiles.loader import load_profile, profile_hash
from tactile_core.profiles.model import profile_schema

FAKES = Path(__file__).resolve().parents[1] / "fakes" / "site_packages"
BASE = """\
schema: 1
name: base
image: {width_px: 32, height_px: 24, mm_per_px: 0.1}
illumination:
  use: core.constant
  channels: [grey]
  driver: {use: mylab.box, port: a, baud: 300}
"""


@pytest.fixture(autouse=True)
def mylab(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(FAKES)


@pytest.fixture
def base(tmp_path: Path) -> Path:
    path = tmp_path / "base.yaml"
    path.write_text(BASE)
    return path


def revised(base: Path, illumination: str) -> Component | None:
    path = base.with_name("revised.yaml")
    path.write_text(f"extends: {base.name}\nname: revised\nillumination: {illumination}\n")
    return load_profile(path).illumination.driver


def test_the_driver_has_its_own_options(base: Path) -> None:
    profile = load_profile(base)
    assert profile.illumination.driver is not None
    assert profile.illumination.driver.use == "mylab.box"
    assert profile.illumination.driver.options == {"port": "a", "baud": 300}
    assert profile.illumination.options == {"channels": ["grey"]}
    assert profile.components["illumination.driver"] == profile.illumination.driver


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("baud: 300", "bauds: 300", "7:37: illumination.driver.bauds: unknown key; did you mean"),
        ("baud: 300", "baud: 0", "7:37: illumination.driver.baud: should be greater than 0"),
        (
            "mylab.box",
            "mylab.bx",
            "7:12: illumination.driver.use: plugin 'mylab' (tactile-mylab 1.4) has no light driver",
        ),
        ("driver:", "drivr:", "7:3: illumination.drivr: unknown key; did you mean 'driver'?"),
        ("mylab.box", "mylab.ring", "is of the kind illumination"),
        ("{use: mylab.box, port: a, baud: 300}", "mylab.box", "write {use: mylab.box}"),
        ("use: mylab.box, ", "", "7:3: illumination.driver.use: is missing"),
    ],
)
def test_an_error_of_the_driver_is_reported_at_its_position(
    base: Path, old: str, new: str, message: str
) -> None:
    base.write_text(BASE.replace(old, new))
    with pytest.raises(ProfileError) as caught:
        load_profile(base)
    (problem,) = caught.value.problems
    assert message in str(problem)


def test_a_revision_changes_only_the_options_it_names(base: Path) -> None:
    driver = revised(base, "{driver: {port: b}}")
    assert driver is not None
    assert driver.options == {"port": "b", "baud": 300}


def test_another_driver_inherits_no_options(base: Path) -> None:
    text = BASE.replace("mylab.box, port: a, baud: 300", "mylab.other, wire: 3")
    base.write_text(text)
    driver = revised(base, "{driver: {use: mylab.box, port: b}}")
    assert driver is not None
    assert driver.options == {"port": "b"}


def test_null_removes_the_driver(base: Path) -> None:
    assert revised(base, "{driver: null}") is None


def test_another_illumination_keeps_the_driver(base: Path) -> None:
    driver = revised(base, "{use: mylab.ring}")
    assert driver is not None
    assert driver.options == {"port": "a", "baud": 300}


def test_the_profile_hash_does_not_depend_on_the_driver(base: Path) -> None:
    with_driver = load_profile(base)
    without = load_profile(base, overrides={"illumination": {"driver": None}})
    assert profile_hash(with_driver) == profile_hash(without)


def test_the_schema_includes_the_driver() -> None:
    lighting = profile_schema()["$defs"]["Lighting"]
    assert {"use", "driver"} <= lighting["properties"].keys()
