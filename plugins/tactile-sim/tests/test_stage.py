"""The virtual stage, and scripts that move its object."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from support.command_line import refused, tactile

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npz
from tactile_core.profiles.loader import list_profiles
from tactile_sim import VirtualStage
from tactile_sim.script import Script

SCRIPT = """\
steps:
  - indenter: {kind: sphere, diameter_mm: 5, x_mm: 1.0, y_mm: -0.5}
  - press: {depth_mm: 0.5, frames: 2}
  - shear: {dx_mm: 0.3, frames: 2}
  - hold: {seconds: 1, frames: 1}
  - release: {}
"""


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "script.yaml"
    path.write_text(SCRIPT)
    return path


@pytest.mark.parametrize("name", [entry.name for entry in list_profiles()])
def test_every_shipped_profile_has_a_virtual_sensor(name: str) -> None:
    stage = VirtualStage(name)
    undeformed = stage.frame()
    stage.indenter("sphere", diameter_mm=3.0)
    stage.press(depth_mm=0.3)
    pressed = stage.frame()
    image = stage.profile.image
    assert pressed.pixels.shape == (image.height_px, image.width_px, len(pressed.channels))
    assert not np.array_equal(pressed.pixels, undeformed.pixels)
    truth = stage.truth()
    assert truth.height_mm.max() == pytest.approx(0.3, rel=0.12)
    assert truth.wrench[2] > 0


def test_the_same_seed_and_moves_give_the_same_frames() -> None:
    def taken(seed: int) -> np.ndarray:
        stage = VirtualStage("hex_fingertip", seed)
        stage.indenter("flat", diameter_mm=4.0)
        stage.press(force_n=2.0)
        stage.twist(2.0)
        return stage.frame().pixels

    np.testing.assert_array_equal(taken(1), taken(1))
    assert not np.array_equal(taken(1), taken(2))


def test_a_reset_stage_equals_a_new_one() -> None:
    stage = VirtualStage("hex_fingertip")
    first = stage.frame().pixels
    stage.indenter("sphere", diameter_mm=4.0)
    stage.press(depth_mm=0.4)
    stage.reset()
    np.testing.assert_array_equal(stage.frame().pixels, first)
    assert not stage.truth().contact.any()


def test_markers_move_with_the_gel_surface() -> None:
    stage = VirtualStage("hex_fingertip")
    rest = stage.truth().markers_px
    stage.indenter("flat", size_mm=(8.0, 6.0))
    stage.press(depth_mm=0.4)
    stage.shear(dx_mm=0.2)
    moved = stage.truth().markers_px - rest
    middle = np.hypot(*(rest - np.array([319.5, 239.5])).T) < 60
    assert moved[middle, 0].mean() * stage.profile.image.mm_per_px == pytest.approx(0.2, rel=0.2)
    assert np.abs(moved[middle, 1]).max() < 0.2 * moved[middle, 0].mean()


def test_less_friction_slips_earlier() -> None:
    def sticking(friction: float) -> float:
        stage = VirtualStage("hex_fingertip", overrides={"gel": {"friction": friction}})
        stage.indenter("sphere", diameter_mm=6.0)
        stage.press(depth_mm=0.5)
        stage.shear(dx_mm=0.2, steps=4)
        truth = stage.truth()
        return float(truth.stick.sum() / truth.contact.sum())

    assert sticking(0.2) < sticking(0.5) <= sticking(1.5)


def test_a_stage_pickles_in_the_middle_of_a_press() -> None:
    stage = VirtualStage("hex_fingertip")
    stage.indenter("sphere", diameter_mm=4.0)
    stage.press(depth_mm=0.3)
    again = pickle.loads(pickle.dumps(stage))
    for one in (stage, again):
        one.shear(dx_mm=0.1)
    np.testing.assert_array_equal(stage.truth().wrench, again.truth().wrench)
    np.testing.assert_array_equal(stage.frame().pixels, again.frame().pixels)


def test_a_script_is_played_frame_by_frame(script: Path) -> None:
    moves, stage = Script(script), VirtualStage("hex_fingertip")
    depths = [stage.depth_mm for _ in moves.play_frames(stage)]
    assert len(depths) == moves.frames == 7
    assert depths == pytest.approx([0, 0.25, 0.5, 0.5, 0.5, 0.5, 0])


def test_a_script_leaves_out_the_first_frames_and_keeps_every_second(script: Path) -> None:
    script.write_text(SCRIPT + "skip: 1\nevery: 2\n")
    moves, stage = Script(script), VirtualStage("hex_fingertip")
    depths = [stage.depth_mm for _ in moves.play_frames(stage)]
    assert len(depths) == moves.frames == 3
    assert depths == pytest.approx([0.25, 0.5, 0.5])
    script.write_text(SCRIPT + "skip: 7\n")
    with pytest.raises(InputError, match="skip: leaves no frame of 7"):
        Script(script)


@pytest.mark.parametrize(("weight_n", "falls"), [(1.0, False), (3.0, True)])
def test_a_lift_carries_what_friction_holds(script: Path, weight_n: float, falls: bool) -> None:
    script.write_text(
        "steps:\n"
        "  - indenter: {kind: cylinder, diameter_mm: 20, texture: {kind: ribs, relief_mm: 0.05}}\n"
        "  - press: {force_n: 4, frames: 1, seconds: 0.1}\n"
        f"  - lift: {{weight_n: {weight_n}, height_mm: 3, frames: 3, shake: 0.05}}\n"
    )
    stage = VirtualStage("hex_fingertip", overrides={"gel": {"friction": 0.5}})
    *_, _ = Script(script).play_frames(stage)
    fallen_mm = stage.truth().pose.y_mm
    assert fallen_mm == pytest.approx(3.0) if falls else fallen_mm < 0.5
    assert stage.wrench[1] == pytest.approx(min(weight_n, 2.0), rel=0.15)


def test_another_unit_gives_other_frames_of_the_same_press(script: Path, tmp_path: Path) -> None:
    script.write_text("steps: [{hold: {seconds: 1, frames: 1}}]\nskip: 1\n")
    frames = []
    for unit in ("1", "2"):
        out = tmp_path / unit
        words = "simulate", "hex_fingertip", "--script", script, "--out", out, "--mode", "fast"
        assert tactile(*words, "--unit", unit).returncode == 0
        frames.append((out / "frames" / "000000.png").read_bytes())
    assert frames[0] != frames[1]


def test_an_impossible_step_is_reported_with_its_line_number(script: Path) -> None:
    script.write_text(SCRIPT.replace("depth_mm: 0.5", "depth_mm: 7"))
    with pytest.raises(InputError, match=r"script.yaml:3:5: .*pressed 7 mm deep .*2 mm thick"):
        list(Script(script).play_frames(VirtualStage("hex_fingertip")))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("pres: {depth_mm: 0.5}", r"script.yaml:3:5: .*did you mean 'press'"),
        ("press: {depth_mm: 0.5, force_n: 1}", "depth_mm or force_n"),
        ("shear: {dx_mm: 0.1, frames: 0}", "greater than 0"),
        ("shear: {dx_mm: 0.1, frames: 2000000}", r"at most 1e\+06"),
        ("twist: {degrees: fast}", "a number"),
        (
            "press: {depth_mm: -0.5}",
            r"script.yaml:3:13: steps.1.press.depth_mm: .*at least 0",
        ),
        ("indenter: {kind: spher}", r"script.yaml:3:5: .*do you mean 'sphere'"),
        ("indenter: {kind: sphere, diameter_mm: big}", "should be a number, not 'big'"),
        ("indenter: {kind: flat, size_mm: 3}", "two numbers, not 3"),
        ("indenter: {kind: letters, text: 5}", "in quotes"),
        ("indenter: {kind: heightmap, height_mm: [[1], [a]], mm_per_px: 1}", "rows of numbers"),
    ],
)
def test_a_mistake_in_a_script_is_reported_with_its_location(
    script: Path, tmp_path: Path, wrong: str, message: str
) -> None:
    script.write_text(SCRIPT.replace("press: {depth_mm: 0.5, frames: 2}", wrong))
    with pytest.raises(InputError, match=message):
        Script(script)


def test_the_command_writes_frames_and_their_ground_truth(script: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = "simulate", "desktop_six_led", "--script", script, "--out", out, "--mode", "fast"
    done = tactile(*words)
    assert done.returncode == 0, done.stderr
    names = sorted(path.name for path in (out / "frames").iterdir())
    assert names == sorted(path.stem for path in (out / "truth").iterdir())
    assert len(list((out / "frames" / names[0]).iterdir())) == 6
    last = read_npz(out / "truth" / f"{names[2]}.npz")
    assert last["height_mm"].max() == pytest.approx(0.5, rel=0.03)
    assert last["contact"].any()
    ran = tactile(
        *("run", "desktop_six_led", "--input", out / "frames"),
        *("--reference", out / "reference", "--json"),
    )
    assert ran.returncode == 0, ran.stderr
    assert len(ran.stdout.splitlines()) == len(names)
    assert "already exists" in refused(*words)
