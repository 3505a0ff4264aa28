"""The claims of the README, on recordings of real sensors and by the command line."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from support.command_line import tactile

pytestmark = pytest.mark.headline

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def split(recordings: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Presses of a sensor without markers: 16 to calibrate on, 4 held out."""
    folder = tmp_path_factory.mktemp("split")
    presses = sorted((recordings / "three_colour/objectfolder/presses").glob("*.png"))
    for name, chosen in (("train", presses[:16]), ("held_out", presses[16:])):
        (folder / name).mkdir()
        for path in chosen:
            shutil.copy(path, folder / name)
    return folder


def test_a_sensor_added_by_yaml_measures_held_out_presses(recordings: Path, split: Path) -> None:
    profile = EXAMPLES / "objectfolder.yaml"
    reference = recordings / "three_colour/objectfolder/reference.png"
    done = tactile(
        *("calibrate", profile, "--presses", split / "train", "--reference", reference),
        *("--ball-diameter-mm", 4.0, "--out", split / "bundle", "--json"),
    )
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["model"] == "core.mlp"
    assert all(press["used"] for press in report["presses"])
    assert report["held_out"]["normal_error_deg"]["mean"] < 2.6

    done = tactile(
        *("run", profile, "--bundle", split / "bundle", "--input", split / "held_out"),
        *("--out", split / "out", "--json"),
    )
    assert done.returncode == 0, done.stderr
    for line in map(json.loads, done.stdout.splitlines()):
        assert 0.5 < line["max_height_mm"] < 2.5
        assert 3 < line["contact_area_mm2"] < 15
        with np.load(split / "out" / f"{line['source']}.npz") as data:
            undeformed = ~data["contact"] & (np.hypot(*data["gradients"].transpose(2, 0, 1)) < 0.1)
            assert np.sqrt(np.mean(data["height_mm"][undeformed] ** 2)) < 0.1


def test_a_sensor_with_markers_and_a_warp_finds_its_presses(
    recordings: Path, tmp_path: Path
) -> None:
    source = recordings / "three_colour/wedge"
    for number in range(12):
        (tmp_path / "presses").mkdir(exist_ok=True)
        shutil.copy(source / f"ball-{number}.jpg", tmp_path / "presses")
    shutil.copy(source / "5mm-0.jpg", tmp_path / "presses")
    done = tactile(
        *("calibrate", EXAMPLES / "wedge" / "wedge.yaml", "--presses", tmp_path / "presses"),
        *("--reference", source / "bg-0.jpg", "--ball-diameter-mm", 4.84),
        *("--model", "core.polynomial", "--out", tmp_path / "bundle", "--json"),
    )
    assert done.returncode == 0, done.stderr
    presses = {press["file"]: press for press in json.loads(done.stdout)["presses"]}
    other_object = presses.pop("5mm-0.jpg")
    assert all(press["used"] for press in presses.values())
    assert not other_object["used"]
    assert other_object["why"]
