"""Loading a profile by name or path, and reporting all its errors."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tactile_core
from tactile_core.errors import Problem, ProfileError
from tactile_core.profiles.components import check_components
from tactile_core.profiles.loader import (
    load_profile,
    load_source,
    profile_hash,
    validate_structure,
)

VALID = """\
schema: 1
name: bench
image: {width_px: 320, height_px: 240, mm_per_px: 0.05}
gel: {thickness_mm: 2, markers: {pitch_mm: 1.5, diameter_mm: 0.5}}
camera: {use: core.replay, loop: true}
estimators:
  height: {use: core.poisson}
  contact: {use: core.contact}
"""

INVALID = """\
schema: 1
name: my bench
revision: 2017
image:
  width_px: wide
  height_px: 240
  mm_per_px: -0.05
  flip: horizontl
  colour: rgb
gel:
  shape: dome
  thickness_mm: 2
  thickness_mm: 3
  markers: {pitch_mm: 1.5, diameter_mm: 2}
camera: {use: core.replai}
illumination: {use: nolab.ring}
calibration: {use: core.automatic, presses_for_network: few}
"""

INVALID_MESSAGES = [
    "2:1: name: should consist of up to 100 letters, digits, '_', '.' and '-' and not begin "
    "with '.' or '-', not 'my bench'",
    '3:1: revision: should be text, not 2017; write it in quotes: "2017"',
    "5:3: image.width_px: should be a whole number, not 'wide'",
    "7:3: image.mm_per_px: should be greater than 0, not -0.05",
    "8:3: image.flip: should be 'none', 'horizontal', 'vertical' or 'both', not 'horizontl'; "
    "did you mean 'horizontal'?",
    "9:3: image.colour: unknown key; did you mean 'color'?",
    "10:1: gel.radius_mm: is missing, and a dome needs it; add it",
    "13:3: gel.thickness_mm: repeated key; the first is on line 12",
    "14:28: gel.markers.diameter_mm: should be smaller than pitch_mm, not 2: "
    "markers must not touch",
    "15:10: camera.use: plugin 'core' (tactile-core 0.1.0) has no camera 'replai'; "
    "did you mean 'replay'?",
    "16:16: illumination.use: illumination 'nolab.ring' needs the plugin 'nolab', which is not "
    "installed; run 'pip install tactile-nolab'",
    "17:36: calibration.presses_for_network: should be a whole number, not 'few'",
]

PATHS = [
    *[("image", key) for key in ("width_px", "mm_per_px", "crop", "flip", "lens", "warp", "lense")],
    *[("gel", key) for key in ("shape", "radius_mm", "markers", "friction")],
    *[("gel", "markers", key) for key in ("pitch_mm", "diameter_mm")],
    *[("image", "warp", "source"), ("image", "lens", "distortion"), ("estimators", "new")],
    *[("camera", key) for key in ("use", "path", "loop")],
    *[("illumination",), ("illumination", "lights"), ("estimators",), ("calibration", "use")],
    *[("name",), ("schema",), ("sim",), ("sim", "gel"), ("extends",), ("image",), ("gel",)],
]
junk = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=4)
    | st.sampled_from(["core.poisson", "core.replay", "core.", "auto", "dome", "flat", "rgb"]),
    lambda inner: (
        st.lists(inner, max_size=5)
        | st.dictionaries(st.sampled_from(["use", "name", "source", "shape", "x"]), inner)
    ),
    max_leaves=6,
)


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def problems_of(path: Path | str, **how: Any) -> list[Problem]:
    with pytest.raises(ProfileError) as caught:
        load_profile(path, **how)
    assert all(str(problem) in str(caught.value) for problem in caught.value.problems)
    return list(caught.value.problems)


def messages_of(text: str, folder: Path) -> list[str]:
    path = write(folder, "p.yaml", text)
    return [str(problem).removeprefix(f"{path}:") for problem in problems_of(path)]


def test_all_errors_are_reported_together_with_their_lines(tmp_path: Path) -> None:
    assert messages_of(INVALID, tmp_path) == INVALID_MESSAGES


def test_the_message_counts_the_errors(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match=r"^there are 12 problems with the profile:\n"):
        load_profile(write(tmp_path, "p.yaml", INVALID))
    with pytest.raises(ProfileError) as one:
        load_profile(write(tmp_path, "p.yaml", VALID + "gell: {}\n"))
    assert "\n" not in str(one.value)


def test_each_missing_plugin_is_named_with_its_pip_command(tmp_path: Path) -> None:
    text = VALID.replace("core.replay", "nowhere.camera").replace("core.poisson", "elsewhere.step")
    with pytest.raises(ProfileError) as both:
        load_profile(write(tmp_path, "p.yaml", text))
    heading, *lines = str(both.value).splitlines()
    assert "mistake" not in heading
    for line, plugin in zip(lines, ("nowhere", "elsewhere"), strict=True):
        assert f"needs the plugin {plugin!r}, which is not installed" in line
        assert f"run 'pip install tactile-{plugin}'" in line


def test_errors_have_file_line_column_and_key(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", VALID.replace("loop: true", "loop: maybe"))
    assert problems_of(path) == [
        Problem(path, 5, 28, "camera.loop", "should be true or false, not 'maybe'")
    ]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("schema: 1", "schema: 2", "1:1: schema: should be 1, not 2"),
        ("name: bench", "", "1:1: name: is missing; add it"),
        ("width_px: 320, ", "", "3:1: image.width_px: is missing; add it"),
        ("width_px", "widht_px", "3:9: image.widht_px: unknown key; did you mean 'width_px'?"),
        ("width_px: 320", "width_px: 320.5", "should be a whole number, not 320.5"),
        ("width_px: 320", "width_px: yes", "should be a whole number, not 'yes'"),
        ("width_px: 320", "width_px: true", "should not be true"),
        ("width_px: 320", "width_px: 99999", "should be at most 32766, not 99999"),
        ("mm_per_px: 0.05", "mm_per_px: .inf", "should be a finite number"),
        ("mm_per_px: 0.05", "mm_per_px: 20", "is pixels per mm, write 0.05"),
        ("0.05}", "0.05, crop: [0, 0, 9]}", "image.crop: should have 4 items, not 3"),
        ("0.05}", "0.05, crop: [0, 0, 9, 9, 9]}", "image.crop: should have 4 items, not 5"),
        ("0.05}", "0.05, crop: [0, x, 9, 9]}", "image.crop.1: should be a whole number, not 'x'"),
        ("0.05}", "0.05, crop: 3}", "image.crop: should be a list, not 3"),
        ("0.05}", "0.05, warp: 3}", "image.warp: should be a mapping of keys to values, not 3"),
        (
            "0.05}",
            "0.05, warp: {source: [[0, 0]], target: [[0, 0], [9, 0], [0, 9], [9, 9]]}}",
            "image.warp.source: should have 4 items, not 1",
        ),
        ("thickness_mm: 2", "radius_mm: 20", "gel.radius_mm: belongs to 'shape: dome'"),
        ("pitch_mm", "pitch", "4:34: gel.markers.pitch: unknown key; did you mean 'pitch_mm'?"),
        (
            "{pitch_mm: 1.5, diameter_mm: 0.5}",
            "some",
            "gel.markers: should be a mapping of keys to values or 'auto', not 'some'",
        ),
        (
            "{use: core.replay, loop: true}",
            "core.replay",
            "5:1: camera: should be a mapping; write {use: core.replay}",
        ),
        ("use: core.replay", "uses: core.replay", "camera.use: is missing; add it"),
        ("use: core.replay", "use: replay", "should be plugin.name, as 'tactile plugins' lists it"),
        ("use: core.replay", "use: core.", "should be plugin.name, as 'tactile plugins' lists it"),
        (
            "use: core.replay",
            "use: core.poisson",
            "core.poisson of tactile-core 0.1.0 is of the kind est",
        ),
        ("loop: true", "lop: true", "5:28: camera.lop: unknown key; did you mean 'loop'?"),
        ("{use: core.poisson}", "[1]", "estimators.height: should be a mapping of keys to values"),
    ],
)
def test_each_error_has_a_clear_message(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in VALID
    (only,) = messages_of(VALID.replace(old, new), tmp_path)
    assert message in only


@settings(deadline=None, max_examples=100)
@given(st.lists(st.tuples(st.sampled_from(PATHS), junk), min_size=1, max_size=4))
def test_any_profile_is_loaded_or_rejected_with_reasons(
    changes: list[tuple[tuple[str, ...], Any]],
) -> None:
    overrides: dict[str, Any] = {}
    for path, value in changes:
        for key in reversed(path):
            value = {key: value}
        overrides |= value
    source = load_source("hex_fingertip", sim=True, overrides=overrides)
    problems = {*source.problems, *validate_structure(source), *check_components(source).problems}
    assert all(problem.message and "\n" not in problem.message for problem in problems)
    if problems:
        assert set(problems_of("hex_fingertip", sim=True, overrides=overrides)) == problems
    else:
        load_profile("hex_fingertip", sim=True, overrides=overrides)


def test_a_minimal_profile_is_loaded_with_defaults(tmp_path: Path) -> None:
    profile = load_profile(write(tmp_path, "p.yaml", "\n".join(VALID.splitlines()[:3])))
    assert {key: part.use for key, part in profile.components.items()} == {
        "camera": "core.replay",
        "illumination": "core.constant",
        "calibration": "core.automatic",
    }


def test_the_components_are_listed_in_order(tmp_path: Path) -> None:
    profile = load_profile(write(tmp_path, "p.yaml", VALID))
    assert list(profile.components) == [
        *("camera", "illumination", "calibration"),
        *("estimators.height", "estimators.contact"),
    ]


def test_a_revision_contains_only_differences(tmp_path: Path) -> None:
    write(tmp_path, "lab/base.yaml", VALID)
    revised = write(
        tmp_path,
        "revised.yaml",
        "extends: lab/base.yaml\nrevision: b\ngel: {markers: null, thickness_mm: 3}\n"
        "estimators: {contact: null}\ncamera: {loop: null}\n",
    )
    profile = load_profile(revised)
    assert (profile.name, profile.revision) == ("bench", "b")
    assert profile.gel.markers is None
    assert profile.gel.thickness_mm == 3
    assert list(profile.estimators) == ["height"]
    assert profile.camera.options == {}


def test_an_inherited_error_is_reported_in_its_own_file(tmp_path: Path) -> None:
    base = write(tmp_path, "base.yaml", VALID.replace("thickness_mm: 2", "thickness_mm: two"))
    top = write(tmp_path, "top.yaml", "extends: base.yaml\ngel: {friction: -1}\n")
    first, second = problems_of(top)
    assert (first.file, first.line, first.key) == (base, 4, "gel.thickness_mm")
    assert (second.file, second.line, second.key) == (top, 2, "gel.friction")


def test_a_profile_can_extend_a_shipped_one_of_the_same_name(tmp_path: Path) -> None:
    path = write(tmp_path, "hex_fingertip.yaml", "extends: hex_fingertip\nrevision: mine\n")
    assert load_profile(path).gel == load_profile("hex_fingertip").gel


def test_a_cycle_of_profiles_is_reported_with_its_members(tmp_path: Path) -> None:
    write(tmp_path, "a.yaml", "extends: b.yaml\n")
    write(tmp_path, "b.yaml", "extends: c.yaml\n")
    c = write(tmp_path, "c.yaml", "extends: ./a.yaml\n")
    (problem,) = problems_of(tmp_path / "a.yaml")
    assert (problem.file.resolve(), problem.line, problem.key) == (c, 1, "extends")
    assert problem.message.endswith("in a circle: a.yaml → b.yaml → c.yaml → a.yaml")


def test_a_profile_that_extends_itself_is_a_cycle(tmp_path: Path) -> None:
    (problem,) = problems_of(write(tmp_path, "a.yaml", "extends: a.yaml\n"))
    assert "circle: a.yaml → a.yaml" in problem.message


@pytest.mark.parametrize(
    ("extends", "message"),
    [
        ("hex_fingertp", "did you mean 'hex_fingertip'?"),
        ("gone.yaml", "there is no file"),
        ("[a, b]", "name one profile"),
        ("bad.yaml", "not YAML"),
    ],
)
def test_a_missing_parent_does_not_hide_other_errors(
    tmp_path: Path, extends: str, message: str
) -> None:
    write(tmp_path, "bad.yaml", "a: [\n")
    path = write(tmp_path, "p.yaml", f"extends: {extends}\ngel: {{friction: -1}}\n")
    problems = problems_of(path)
    assert len(problems) == 2
    assert any(message in str(problem) for problem in problems)
    assert Problem(path, 2, 7, "gel.friction", "should be at least 0, not -1") in problems


def test_relative_paths_are_relative_to_their_own_file(tmp_path: Path) -> None:
    write(tmp_path, "lab/base.yaml", VALID.replace("loop: true", "path: in/press.png"))
    top = write(tmp_path, "top.yaml", "extends: lab/base.yaml\n")
    assert load_profile(top).camera.options["path"] == str(tmp_path / "lab/in/press.png")
    own = write(tmp_path, "own.yaml", "extends: lab/base.yaml\ncamera: {path: here.png}\n")
    assert load_profile(own).camera.options["path"] == str(tmp_path / "here.png")
    fixed = write(tmp_path, "fixed.yaml", "extends: lab/base.yaml\ncamera: {path: /data}\n")
    assert load_profile(fixed).camera.options["path"] == "/data"


def test_the_virtual_sensor_is_the_profile_with_its_sim_section(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", VALID + "sim: {gel: {friction: 0.7, markers: null}}\n")
    real, virtual_profile = load_profile(path), load_profile(path, sim=True)
    assert (real.gel.friction, virtual_profile.gel.friction) == (None, 0.7)
    assert real.gel.markers is not None
    assert virtual_profile.gel == real.gel.model_copy(update={"friction": 0.7, "markers": None})


def test_errors_in_the_sim_section_are_always_reported(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", VALID + "sim:\n  gel: {fricton: 0.7}\n  name: true\n")
    assert [(p.line, p.key) for p in problems_of(path)] == [
        (10, "sim.gel.fricton"),
        (11, "sim.name"),
    ]
    assert {p.line for p in problems_of(path, sim=True)} == {10, 11}


def test_overrides_take_precedence_over_the_sim_section(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", VALID + "sim: {gel: {friction: 0.7}}\n")
    overrides = {"gel": {"friction": 0.2, "markers": None}, "estimators": {"contact": None}}
    profile = load_profile(path, sim=True, overrides=overrides)
    assert profile.gel.friction == 0.2
    assert profile.gel.markers is None
    assert list(profile.estimators) == ["height"]


def test_an_error_in_an_override_is_reported_as_such(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", VALID)
    (problem,) = problems_of(path, overrides={"gel": {"frict": 0.2}})
    assert str(problem) == "overrides: gel.frict: unknown key; did you mean 'friction'?"


def test_overriding_a_profile_with_itself_changes_nothing(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", VALID)
    profile = load_profile(path)
    values = profile.model_dump(by_alias=True, exclude_unset=True)
    assert load_profile(path, overrides=values) == profile


def test_a_missing_plugin_is_reported_with_its_package(tmp_path: Path) -> None:
    text = VALID + "illumination: {use: not_here_yet.tricolour}\n"
    (message,) = messages_of(text, tmp_path)
    assert message.startswith("9:16: illumination.use: ")
    assert message.endswith("run 'pip install tactile-not-here-yet'")


def test_a_plugin_of_the_clone_is_installed_from_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tactile_core, "__file__", str(tmp_path / "tactile_core" / "__init__.py"))
    (tmp_path / "plugins" / "tactile-not-here-yet").mkdir(parents=True)
    text = VALID + "illumination: {use: not_here_yet.tricolour}\n"
    (message,) = messages_of(text, tmp_path)
    assert message.endswith(f"run 'pip install {tmp_path}/plugins/tactile-not-here-yet'")


def test_structure_and_components_are_validated_separately(tmp_path: Path) -> None:
    source = load_source(write(tmp_path, "p.yaml", INVALID))
    assert {p.line for p in source.problems} == {13}
    assert {p.line for p in validate_structure(source)} == {2, 3, 5, 7, 8, 9, 10, 14}
    assert {p.line for p in check_components(source).problems} == {15, 16, 17}


def test_structure_is_validated_without_importing_plugins() -> None:
    script = (
        "import sys\n"
        "from tactile_core.profiles.loader import load_profile\n"
        "load_profile('hex_fingertip', components=False)\n"
        "foreign = ('tactile_hex_fingertip', 'tactile_core.builtin', 'pluggy', 'cv2', 'scipy')\n"
        "print([name for name in foreign if name in sys.modules])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_the_profile_hash_covers_what_a_calibration_depends_on() -> None:
    def changed(**overrides: Any) -> bool:
        other = load_profile("hex_fingertip", overrides=overrides)
        return profile_hash(other) != profile_hash(load_profile("hex_fingertip"))

    assert not changed()
    assert not changed(name="renamed", revision="x", gel={"friction": 0.1, "thickness_mm": 3})
    assert not changed(estimators={"contact": None}, image={"rotate_deg": 0})
    assert not changed(image={"mm_per_px": 0.03})
    assert changed(image={"rotate_deg": 180})
    assert changed(gel={"markers": None})
    assert changed(gel={"coating": "semi_specular"})
    assert changed(gel={"shape": "dome", "radius_mm": 30})
    light = {"azimuth_deg": 90, "elevation_deg": 19.0}
    rest = [{"name": n, "azimuth_deg": a, "elevation_deg": 19} for n, a in [("g", 210), ("b", 330)]]
    assert changed(illumination={"lights": [{"name": "r", **light}, *rest]})


def test_a_number_written_in_two_ways_has_one_hash(tmp_path: Path) -> None:
    text = VALID + "illumination: {use: core.constant, lights: [{name: a, azimuth_deg: 1, "
    integer = write(tmp_path, "a.yaml", text + "elevation_deg: 19}]}\n")
    decimal = write(tmp_path, "b.yaml", text + "elevation_deg: 19.0}]}\n")
    assert profile_hash(load_profile(integer)) == profile_hash(load_profile(decimal))
