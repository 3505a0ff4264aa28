"""Impossible values are rejected with a reason before they cost memory or time."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from pydantic import ValidationError

from tactile_core.errors import ProfileError
from tactile_core.interfaces.component import Component
from tactile_core.profiles.loader import load_profile

if TYPE_CHECKING:
    from support.own_plugins import Install

PROFILE = """\
schema: 1
name: bench
image: {width_px: 320, height_px: 240, mm_per_px: 0.05}
gel: {thickness_mm: 2.0, markers: {pitch_mm: 1.0, diameter_mm: 0.3}}
illumination:
  use: core.constant
  lights: [{name: red, azimuth_deg: 90, elevation_deg: 35}]
estimators:
  height: {use: core.poisson, drift_slope: 0.1}
"""

OWN_OPTIONS = """\
from pydantic import BaseModel

from tactile_core.interfaces.estimator import Estimator
from tactile_core.quantities import Gradients, HeightMap


class Step(Estimator):
    class Options(BaseModel):
        gain: float = 1.0
        layers: list[dict[str, float]] = []

    def estimate(self, gradients: Gradients) -> HeightMap: ...
"""


def refusal(folder: Path, text: str) -> str:
    path = folder / "bench.yaml"
    path.write_text(text)
    with pytest.raises(ProfileError) as caught:
        load_profile(path)
    message = str(caught.value)
    assert "\n" not in message
    return message.removeprefix(f"{path}:")


def test_the_unmodified_profile_is_valid(tmp_path: Path) -> None:
    (tmp_path / "bench.yaml").write_text(PROFILE)
    assert load_profile(tmp_path / "bench.yaml").name == "bench"


@pytest.mark.parametrize(
    "name", ["..", ".", ".bench", "-bench", '"abc\\n"', "a" * 101, '"\\e[31m"']
)
def test_an_unsafe_profile_name_is_rejected(tmp_path: Path, name: str) -> None:
    message = refusal(tmp_path, PROFILE.replace("name: bench", f"name: {name}"))
    assert "name: should consist of up to 100 letters" in message
    assert message.isprintable()


def test_a_component_name_with_a_line_break_is_rejected() -> None:
    with pytest.raises(ValidationError, match=r"should be plugin\.name"):
        Component(use="core.poisson\n")


@pytest.mark.parametrize("value", [".nan", ".inf", "-.inf", "1e999", '"nan"'])
@pytest.mark.parametrize(
    ("written", "key"),
    [
        ("azimuth_deg: 90", "illumination.lights.0.azimuth_deg"),
        ("drift_slope: 0.1", "estimators.height.drift_slope"),
        ("thickness_mm: 2.0", "gel.thickness_mm"),
        ("mm_per_px: 0.05", "image.mm_per_px"),
        ("pitch_mm: 1.0", "gel.markers.pitch_mm"),
    ],
)
def test_a_number_that_is_not_finite_is_rejected(
    tmp_path: Path, written: str, key: str, value: str
) -> None:
    text = PROFILE.replace(written, f"{written.split(':')[0]}: {value}")
    assert f"{key}: should be a finite number" in refusal(tmp_path, text)


@pytest.mark.parametrize("option", ["gain: .nan", "layers: [{a: 1}, {b: .inf}]"])
def test_plugin_options_must_be_finite_even_if_their_model_allows_others(
    tmp_path: Path, install: Install, option: str
) -> None:
    install("limits", {"step.py": OWN_OPTIONS}, tactile_estimators={"step": "own_limits.step:Step"})
    text = PROFILE.replace(
        "{use: core.poisson, drift_slope: 0.1}", f"{{use: limits.step, {option}}}"
    )
    assert "should be a finite number" in refusal(tmp_path, text)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("width_px: 320, height_px: 240", "width_px: 9999, height_px: 9999", "50 megapixels"),
        ("mm_per_px: 0.05", "mm_per_px: 1e-300", "no camera resolves"),
        ("mm_per_px: 0.05", "mm_per_px: 0.05, crop: [0, 0, 10000, 10000]", "50 megapixels"),
        ("mm_per_px: 0.05", f"mm_per_px: 0.05, crop: [0, 0, {'9' * 90}, 9]", "at most 1e+09"),
        ("pitch_mm: 1.0", "pitch_mm: 1000000", "px in an image of 320 × 240"),
        ("pitch_mm: 1.0, diameter_mm: 0.3", "pitch_mm: 1e-6, diameter_mm: 1e-7", "px in an image"),
        ("diameter_mm: 0.3", "diameter_mm: 1e-9", "px in an image of 320 × 240"),
        ("thickness_mm: 2.0", "thickness_mm: 1e30", "at most 1e+09"),
        ("schema: 1", "schema: 1\noptics: {lights: {array: [1, 100000]}}", "at most 100"),
        ("schema: 1", "schema: 1\noptics: {coat: {grain_mm: 1000}}", "at most 10"),
        (
            "mm_per_px: 0.05",
            "mm_per_px: 0.05, warp: {source: [[0, 0], [9, 0], [9, 9], [0, 9]],"
            " target: [[0, 0], [1e300, 0], [9, 9], [0, 9]]}",
            "at most 1e+09",
        ),
    ],
)
def test_values_that_would_exhaust_memory_are_rejected(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    assert words in refusal(tmp_path, PROFILE.replace(old, new))


@pytest.mark.parametrize("digits", ["0x" + "f" * 9000, "9" * 9000])
def test_a_number_too_long_to_print_is_rejected(tmp_path: Path, digits: str) -> None:
    message = refusal(tmp_path, PROFILE.replace("thickness_mm: 2.0", f"thickness_mm: {digits}"))
    assert "gel.thickness_mm: should be a " in message
    assert len(message) < 200


def test_a_long_chain_of_profiles_is_rejected(tmp_path: Path) -> None:
    for i in range(2000):
        (tmp_path / f"p{i}.yaml").write_text(f"extends: ./p{i + 1}.yaml\n")
    (tmp_path / "p2000.yaml").write_text(PROFILE)
    with pytest.raises(ProfileError, match="more than 20 profiles extend each other"):
        load_profile(tmp_path / "p0.yaml")
    assert load_profile(tmp_path / "p1980.yaml").name == "bench"


def test_paths_that_are_not_files_are_rejected(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    for path in (tmp_path / "pipe.yaml", Path("/dev/zero")):
        with pytest.raises(ProfileError, match="a pipe or a device"):
            load_profile(path)
    for path in (tmp_path / f"{'x' * 300}.yaml", Path("a\0b.yaml")):
        with pytest.raises(ProfileError):
            load_profile(path)
    with pytest.raises(ProfileError, match="no profile"):
        load_profile("x" * 300)
    with pytest.raises(ProfileError, match="home folder"):
        load_profile("~no_such_user/bench.yaml")
    text = PROFILE.replace("schema: 1", "schema: 1\nextends: ./pipe.yaml")
    assert "extends: there is no file" in refusal(tmp_path, text)


def test_a_path_in_an_unknown_home_folder_is_reported_at_its_line(tmp_path: Path) -> None:
    text = f"{PROFILE}camera: {{use: core.replay, path: ~no_such_user/x.png}}\n"
    assert refusal(tmp_path, text).startswith("10:1: camera: ~no_such_user/x.png: this user has")


def test_control_characters_in_keys_are_escaped(tmp_path: Path) -> None:
    assert refusal(tmp_path, f'{PROFILE}"\\e[31m{"x" * 900}": 1\n').isprintable()
    assert len(refusal(tmp_path, f'{PROFILE}"\\e[31m{"x" * 900}": 1\n')) < 400
