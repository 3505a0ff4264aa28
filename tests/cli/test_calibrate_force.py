"""``tactile calibrate-force`` on a virtual sensor that is pressed with known forces."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.command_line import refused, tactile
from support.virtual_lab import PROFILE, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.builtin.force_linear import LinearForceModel
from tactile_core.bundles.bundle import Bundle

DEPTHS_MM = (0.0, 0.2, 0.4, 0.6, 0.8)
N_PER_MM3 = 3.0


def force_n(press: BallPress | None, lab: VirtualLab) -> float:
    """Force of a gel that resists the volume that is pressed into it."""
    if press is None:
        return 0.0
    section = lab.profile.image
    height = press.height_mm((section.height_px, section.width_px), section.mm_per_px)
    return float(N_PER_MM3 * height.sum() * section.mm_per_px**2)


@pytest.fixture(scope="module")
def bench(lab: VirtualLab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A profile with a force step, and four recordings with their forces."""
    folder = tmp_path_factory.mktemp("force")
    (folder / "force.yaml").write_text(PROFILE + "  force: {use: core.force_linear}\n")
    (folder / "forces").mkdir()
    rng = np.random.default_rng(5)
    for number in range(4):
        lines = ["frame,fz_n"]
        centre = (float(rng.uniform(50, 110)), float(rng.uniform(45, 75)))
        for frame, depth_mm in enumerate(DEPTHS_MM):
            press = BallPress(centre, 4.0, depth_mm) if depth_mm else None
            lab.save(folder / f"recordings/press_{number}/f{frame}.png", press, seed=frame)
            lines.append(f"{frame},{force_n(press, lab)}")
        (folder / f"forces/press_{number}.csv").write_text("\n".join(lines))
    return folder


@pytest.fixture
def words(bench: Path, lab: VirtualLab) -> Callable[..., list[object]]:
    """Returns the words of a command, with options replaced."""

    def made(**options: object) -> list[object]:
        given = {
            "input": bench / "recordings",
            "forces": bench / "forces",
            "bundle": lab.bundle,
            "out": bench / "unused",
            **options,
        }
        pairs = [(f"--{name}", value) for name, value in given.items() if value is not None]
        return ["calibrate-force", bench / "force.yaml", *(word for pair in pairs for word in pair)]

    return made


def test_known_forces_become_newtons_of_the_next_run(
    bench: Path, lab: VirtualLab, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    done = tactile(*words(out=tmp_path / "fitted"))
    assert done.returncode == 0, done.stderr
    head, columns, row = done.stdout.splitlines()
    assert head.endswith("step 'force' fitted to 20 frames in 4 sequences")
    assert columns.split()[:4] == ["held", "out", "R²", "RMSE"]
    assert float(row.split()[1]) > 0.98
    bundle = Bundle.load(tmp_path / "fitted")
    assert isinstance(bundle.artefact("force"), LinearForceModel)
    assert bundle.calibration is not None
    press = BallPress((80.0, 60.0), 4.0, 0.7)
    image = lab.save(tmp_path / "unseen" / "press.png", press)
    run = ["run", bench / "force.yaml", "--input", image, "--bundle", tmp_path / "fitted", "--json"]
    wrench = json.loads(tactile(*run).stdout)["wrench"]
    true = force_n(press, lab)
    assert wrench["fz_n"] == pytest.approx(true, rel=0.15)
    assert wrench["std"][2] < 0.2 * true


def test_json_has_the_score_of_each_component(
    words: Callable[..., list[object]], tmp_path: Path
) -> None:
    done = tactile(*words(out=tmp_path / "fitted"), "--json")
    found = json.loads(done.stdout)
    assert found["sequences"] == 4
    assert list(found["held_out"]) == ["fz_n"]
    score = found["held_out"]["fz_n"]
    assert score["r2"] > 0.98
    assert score["percent_of_range"] < 5
    assert score["proportional"]["r2"] > 0.9
    assert found["bundle"] == str(tmp_path / "fitted")
    assert found["rotation"] is None


def test_one_recording_is_divided_where_the_force_rests(
    bench: Path, lab: VirtualLab, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    lines = ["file,fz_n"]
    for number in range(3):
        for frame, depth_mm in enumerate(DEPTHS_MM):
            press = BallPress((60.0 + 20 * number, 60.0), 4.0, depth_mm) if depth_mm else None
            name = f"f{number}{frame}.png"
            lab.save(tmp_path / "one" / name, press, seed=frame)
            lines.append(f"{name},{force_n(press, lab)}")
    forces = tmp_path / "forces.csv"
    forces.write_text("\n".join(lines))
    changed = {"input": tmp_path / "one", "forces": forces, "out": tmp_path / "fitted"}
    assert json.loads(tactile(*words(**changed), "--json").stdout)["sequences"] == 3


def test_masses_laid_on_the_sensor_are_enough(
    lab: VirtualLab, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    lines = ["file,mass_g"]
    for number, depth_mm in enumerate((0.2, 0.3, 0.45, 0.6, 0.8)):
        press = BallPress((70.0 + 5 * number, 60.0), 4.0, depth_mm)
        lab.save(tmp_path / "masses" / f"m{number}.png", press, seed=number)
        lines.append(f"m{number}.png,{1e3 * force_n(press, lab) / 9.80665}")
    weights = tmp_path / "weights.csv"
    weights.write_text("\n".join(lines))
    changed = {"input": tmp_path / "masses", "forces": None, "weights": weights}
    found = json.loads(tactile(*words(**changed, out=tmp_path / "fitted"), "--json").stdout)
    assert found["sequences"] == 5
    assert found["held_out"]["fz_n"]["r2"] > 0.9


def test_what_the_step_could_be_fitted_to_must_be_measured(
    bench: Path, lab: VirtualLab, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    done = refused(*words(bundle=None, reference=lab.reference, out=tmp_path / "fitted"))
    assert "needs a displacement, a contact, a height or a load" in done
    assert "give --reference" in refused(*words(bundle=None, out=tmp_path / "fitted"))
    assert not (tmp_path / "fitted").exists()


def test_without_a_model_the_step_is_left_out_with_a_note(bench: Path, lab: VirtualLab) -> None:
    image = bench / "recordings/press_0/f4.png"
    done = tactile("run", bench / "force.yaml", "--input", image, "--bundle", lab.bundle, "--json")
    assert json.loads(done.stdout)["wrench"] is None
    assert "these steps are left out: force; fit one with 'tactile calibrate-force'" in done.stderr


def test_a_profile_with_a_force_step_is_valid_without_a_model(bench: Path) -> None:
    assert tactile("validate", bench / "force.yaml").returncode == 0


def replaced(bench: Path, tmp_path: Path, change: Callable[[float], float]) -> Path:
    """Forces of all recordings with other values."""
    folder = tmp_path / "changed"
    folder.mkdir()
    for path in (bench / "forces").iterdir():
        head, *lines = path.read_text().splitlines()
        rows = [line.split(",") for line in lines]
        text = [head, *(f"{frame},{change(float(force))}" for frame, force in rows)]
        (folder / path.name).write_text("\n".join(text))
    return folder


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda force: force + 5.0, "fz_n is 5 where nothing touches the sensor"),
        (lambda force: 2.0, "is the same in every frame"),
    ],
)
def test_forces_that_cannot_be_right_are_refused(
    bench: Path,
    words: Callable[..., list[object]],
    tmp_path: Path,
    change: Callable[[float], float],
    message: str,
) -> None:
    forces = replaced(bench, tmp_path, change)
    assert message in refused(*words(forces=forces, out=tmp_path / "fitted"))


def test_forces_of_other_frames_are_refused(
    bench: Path, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    one = bench / "recordings/press_0"
    forces = tmp_path / "forces.csv"
    forces.write_text("frame,fz_n\n0,0\n1,1\n99,2\n")
    message = refused(*words(input=one, forces=forces))
    assert "1 of 3 lines name a frame that press_0 does not have, such as 99" in message
    forces.write_text("file,fz_n\nf0.png,0\nother.png,2\n")
    assert "name a file" in refused(*words(input=one, forces=forces))


def test_a_single_press_has_no_score(bench: Path, words: Callable[..., list[object]]) -> None:
    one = {"input": bench / "recordings/press_0", "forces": bench / "forces/press_0.csv"}
    assert "one sequence is too few" in refused(*words(**one))


def test_files_of_forces_must_fit_the_recordings(
    bench: Path, words: Callable[..., list[object]], tmp_path: Path
) -> None:
    assert "does not say which" in refused(*words(forces=bench / "forces/press_0.csv"))
    assert "has no press_0.csv" in refused(*words(forces=tmp_path))
    assert "give either --forces" in refused(*words(forces=None))


def test_a_profile_without_such_a_step_is_refused(lab: VirtualLab, bench: Path) -> None:
    inputs = ["--input", bench / "recordings", "--forces", bench / "forces", "--out", bench / "no"]
    message = refused("calibrate-force", lab.profile_path, *inputs, "--bundle", lab.bundle)
    assert "has no step that can be fitted to forces; add 'force:" in message
    words = ["calibrate-force", bench / "force.yaml", *inputs, "--bundle", lab.bundle]
    assert "has no step 'height' that can be fitted" in refused(*words, "--step", "height")
