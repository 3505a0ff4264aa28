"""Recordings of earlier versions are read, and what cannot be is refused with a sentence."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.command_line import refused, tactile

DATA = Path(__file__).parents[1] / "data"
FOLDER, MCAP = DATA / "recording", DATA / "recording.mcap"
BUNDLE = FOLDER / "session" / "bundle"
# What the version that wrote them measured, mm; since then the bulge around a contact no longer
# counts as an error, which had raised heights by 3.5 %
DEPTHS_MM = [2.2493, 2.2154]


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    """The profile of the recordings, with the present name of the virtual camera."""
    text = (DATA / "small_lab.yaml").read_text()
    path = tmp_path / "small_lab.yaml"
    path.write_text(text.replace("core.virtual", "sim.virtual"))
    return path


def measured(*words: object) -> list[dict[str, object]]:
    done = tactile("run", *words, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_a_folder_measures_what_it_measured_on_its_day(profile: Path) -> None:
    readings = measured(profile, "--input", FOLDER)
    # today, what only a shadow could have caused beside a contact is no part of its height
    assert [reading["max_height_mm"] for reading in readings] == pytest.approx(DEPTHS_MM, rel=0.1)


def test_frames_of_a_camera_that_has_another_name_now_are_read(profile: Path) -> None:
    readings = measured(profile, "--input", MCAP, "--bundle", BUNDLE)
    assert [reading["sequence"] for reading in readings] == [0, 1]


def test_its_bundle_of_an_older_format_is_refused_and_another_asked_for(profile: Path) -> None:
    assert refused("run", profile, "--input", MCAP) == (
        f"tactile: the bundle in {MCAP} cannot be used (format 4 is older than this version reads "
        f"(5)); give --bundle\n"
    )


@pytest.mark.parametrize("source", [FOLDER, MCAP], ids=["folder", "mcap"])
def test_an_earlier_recording_becomes_a_recording_of_today(
    source: Path, profile: Path, tmp_path: Path
) -> None:
    for out in ("again.mcap", "again"):
        assert tactile("convert", source, tmp_path / out).returncode == 0
        words = "--input", tmp_path / out, "--bundle", BUNDLE
        assert len(measured(profile, *words)) == 2
