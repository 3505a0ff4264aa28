"""The examples in the README and the short guides run as printed."""

import json
import re
import shutil
from pathlib import Path

import pytest
from support.command_line import tactile
from support.height_lab import make_height_lab
from support.pages import ROOT, block, blocks, commands, known_commands
from support.virtual_lab import VirtualLab

from tactile_core.formats.images import write_png
from tactile_core.profiles.loader import load_profile
from tactile_sim import VirtualStage

GUIDES = ROOT / "docs" / "how-to"
PROFILES = (GUIDES / "write-a-profile.md").read_text()
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("plugins/*/README.md"))]


def test_the_profile_is_valid(tmp_path: Path) -> None:
    path = tmp_path / "my_sensor.yaml"
    path.write_text(blocks("yaml", PROFILES)[0])
    assert load_profile(path).name == "my_sensor"


def test_a_revision_takes_one_line(tmp_path: Path) -> None:
    (tmp_path / "my_sensor.yaml").write_text(blocks("yaml", PROFILES)[0])
    path = tmp_path / "second.yaml"
    path.write_text('extends: my_sensor.yaml\nrevision: "2"\n')
    assert load_profile(path).revision == "2"


def test_a_variant_of_a_shipped_rig_is_valid(tmp_path: Path) -> None:
    path = tmp_path / "variant.yaml"
    path.write_text(blocks("yaml", PROFILES)[1])
    variant = load_profile(path)
    assert variant.calibration.options["lights"] == "given"
    assert variant.estimators["height"].use == "core.robust_poisson"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.parent.name)
def test_every_named_command_and_option_exists(page: Path) -> None:
    known = known_commands()
    for name, *words in commands(page.read_text()):
        options = {option for parameter in known[name].params for option in parameter.opts}
        assert {word for word in words if word.startswith("--")} <= options


def test_the_calibration_with_a_height_map_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lab").mkdir()
    lab = make_height_lab(tmp_path / "lab")
    shutil.copy(lab.profile, tmp_path / "my_sensor.yaml")
    shutil.copytree(lab.press, tmp_path / "scan")
    shutil.copy(lab.tmd, tmp_path / "heightmap.tmd")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "reference" / "commands.md").read_text()
    (words,) = (words for words in commands(page) if "heightmap.tmd" in words)
    done = tactile(*words, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["held_out"]["normal_error_deg"]["mean"] < 2
    assert (tmp_path / "bundle" / "report.html").exists()


def test_the_first_script_prints_a_line_per_image(
    lab: VirtualLab,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copy(lab.profile_path, tmp_path / "my_sensor.yaml")
    shutil.copytree(lab.bundle, tmp_path / "bundle")
    shutil.copytree(lab.presses, tmp_path / "recording")
    monkeypatch.chdir(tmp_path)
    exec(block("python"), {})
    assert len(capsys.readouterr().out.splitlines()) == 10


def test_the_script_for_the_virtual_gel_runs(
    capsys: pytest.CaptureFixture[str],
) -> None:
    exec(blocks("python", (GUIDES / "use-a-virtual-sensor.md").read_text())[0], {})
    assert capsys.readouterr().out.endswith("of the contact sticks\n")


def test_the_script_for_markers_and_slip_runs_on_a_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "recording").mkdir()
    stage = VirtualStage("hex_fingertip", seed=1)
    stage.indenter("sphere", diameter_mm=8)
    write_png(tmp_path / "recording" / "0.png", stage.frame().pixels)
    stage.press(depth_mm=0.5)
    stage.shear(dx_mm=0.2)
    write_png(tmp_path / "recording" / "1.png", stage.frame().pixels)
    monkeypatch.chdir(tmp_path)
    exec(blocks("python", (GUIDES / "measure-slip.md").read_text())[0], {})
    undeformed, sheared = capsys.readouterr().out.splitlines()
    assert undeformed.split()[0] == "none"
    assert 0.15 < float(sheared.split()[1]) < 0.25


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.parent.name)
def test_every_linked_page_and_picture_exists(page: Path) -> None:
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text())
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_the_readme_fits_one_and_a_half_screens() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120
