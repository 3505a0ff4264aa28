"""Sequential lights on the command line: faulty scans and their messages."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.command_line import refused, tactile
from support.height_lab import AZIMUTHS_DEG, HeightLab, make_height_lab

from tactile_core.calibration.fitting import calibrate

Scan = list[np.ndarray]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> HeightLab:
    """A sensor with six lights and its bundle."""
    lab = make_height_lab(tmp_path_factory.mktemp("rig"))
    made = calibrate(lab.profile, lab.press, lab.undeformed, target=lab.tmd)
    made.save(lab.folder / "bundle")
    return lab


def scan_of(rig: HeightLab) -> Scan:
    """Return the exposures of the press, grey."""
    paths = sorted(rig.press.iterdir())
    return [np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)) for path in paths]


def record(folder: Path, exposures: Scan) -> Path:
    folder.mkdir()
    for k, exposure in enumerate(exposures):
        cv2.imwrite(str(folder / f"led{k}.png"), exposure)
    return folder


def run(rig: HeightLab, scan: Path) -> tuple[object, ...]:
    return ("run", rig.profile, "--bundle", rig.folder / "bundle", "--input", scan)


def measured(rig: HeightLab, scan: Path, out: Path) -> dict[str, Any]:
    done = tactile(*run(rig, scan), "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    line: dict[str, Any] = json.loads(done.stdout)
    return line


def test_a_good_scan_is_measured_without_a_warning(rig: HeightLab, tmp_path: Path) -> None:
    assert measured(rig, rig.press, tmp_path)["warnings"] == []


def test_five_images_for_six_lights_are_refused(rig: HeightLab, tmp_path: Path) -> None:
    five = record(tmp_path / "five", scan_of(rig)[:5])
    message = refused(*run(rig, five))
    assert message.count("\n") == 1
    assert "five has 5 images, but the rig takes 6" in message


def test_a_press_of_five_images_is_refused_for_calibration(rig: HeightLab, tmp_path: Path) -> None:
    five = record(tmp_path / "five", scan_of(rig)[:5])
    message = refused(
        *("calibrate", rig.profile, "--presses", five, "--reference", rig.undeformed),
        *("--target", rig.tmd, "--out", tmp_path / "never"),
    )
    assert message.count("\n") == 1
    assert "5 images" in message
    assert not (tmp_path / "never").exists()


def test_colour_images_for_a_grey_profile_are_refused(rig: HeightLab, tmp_path: Path) -> None:
    tinted = [np.dstack([image, image, image // 2]) for image in scan_of(rig)]
    message = refused(*run(rig, record(tmp_path / "tinted", tinted)))
    assert message.count("\n") == 1
    assert "tinted: the image is in colour, but the profile specifies color: grey" in message


def test_a_bundle_of_lights_in_another_order_is_refused(rig: HeightLab, tmp_path: Path) -> None:
    lines = rig.profile.read_text().splitlines(keepends=True)
    first, second = (i for i, line in enumerate(lines) if "led0" in line or "led1" in line)
    lines[first], lines[second] = lines[second], lines[first]
    other = tmp_path / rig.profile.name
    other.write_text("".join(lines))
    message = refused("run", other, "--bundle", rig.folder / "bundle", "--input", rig.press)
    errors = [line for line in message.splitlines() if not line.startswith("note: ")]
    assert len(errors) == 1
    assert "order led1, led0" in errors[0]
    assert "calibrate again" in errors[0]


def test_two_swapped_images_are_refused(rig: HeightLab, tmp_path: Path) -> None:
    exposures = scan_of(rig)
    exposures[0], exposures[3] = exposures[3], exposures[0]
    message = refused(*run(rig, record(tmp_path / "swapped", exposures)))
    assert message.count("\n") == 1
    assert "the exposure of light 'led0' shows light 'led3'" in message


@pytest.mark.parametrize(("level", "why"), [(255, "saturated"), (0, "too dark")])
def test_saturated_and_dark_pixels_are_counted_masked_and_filled(
    rig: HeightLab, tmp_path: Path, level: int, why: str
) -> None:
    exposures = scan_of(rig)
    for exposure in exposures:
        exposure[:40, :40] = level
    line = measured(rig, record(tmp_path / "spoilt", exposures), tmp_path / "out")
    (warning,) = line["warnings"]
    assert f"8% of the frame is {why}" in warning
    with np.load(tmp_path / "out" / "spoilt.npz") as data:
        assert not data["valid"][:40, :40].any()
        assert data["valid"][50:, 50:].all()
        assert np.isfinite(data["height_mm"]).all()


def turned(rig: HeightLab, folder: Path, azimuths_deg: dict[str, int]) -> Path:
    """Write the profile with other azimuths for some lights."""
    text = rig.profile.read_text()
    for k, azimuth in enumerate(AZIMUTHS_DEG):
        there = azimuths_deg.get(f"led{k}", azimuth)
        text = text.replace(f"led{k}, azimuth_deg: {azimuth},", f"led{k}, azimuth_deg: {there},")
    path = folder / rig.profile.name
    path.write_text(text)
    return path


def notes(rig: HeightLab, profile: Path) -> tuple[str, ...]:
    return calibrate(profile, rig.press, rig.undeformed, target=rig.tmd).notes


def test_lights_at_the_positions_in_the_profile_give_no_note(
    rig: HeightLab, tmp_path: Path
) -> None:
    assert notes(rig, turned(rig, tmp_path, {"led3": 75})) == ()


def test_a_light_at_another_azimuth_gives_a_note(rig: HeightLab, tmp_path: Path) -> None:
    (note,) = notes(rig, turned(rig, tmp_path, {"led1": 0, "led2": 60}))
    assert "led1 from -30° (profile 0°)" in note
    assert "led2 from 30° (profile 60°)" in note
    assert "led0" not in note
    assert "correct 'azimuth_deg'" in note


def test_two_swapped_lights_give_a_note_with_the_order(rig: HeightLab, tmp_path: Path) -> None:
    profile = turned(rig, tmp_path, {"led0": 90, "led3": -90})
    (note,) = notes(rig, profile)
    assert "match in the order led3, led1, led2, led0, led4, led5" in note


def test_the_command_prints_the_note_and_calibrates(rig: HeightLab, tmp_path: Path) -> None:
    shutil.copy(turned(rig, tmp_path, {"led1": 30}), tmp_path / "profile.yaml")
    done = tactile(
        *("calibrate", tmp_path / "profile.yaml", "--presses", rig.press),
        *("--reference", rig.undeformed, "--target", rig.tmd, "--out", tmp_path / "bundle"),
        "--json",
    )
    assert done.returncode == 0, done.stderr
    assert "note: light directions differ from the profile: led1" in done.stderr
    assert json.loads(done.stdout)["bundle"]
