"""``tactile convert``."""

from __future__ import annotations

import json
from pathlib import Path

from support.command_line import refused, tactile
from support.damaged_recordings import record
from support.recordings import SESSION, written


def test_it_prints_what_it_wrote(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", 2)
    done = tactile("convert", tmp_path / "a.mcap", tmp_path / "a.h5")
    assert (done.returncode, done.stdout) == (0, f"{tmp_path / 'a.h5'}: 2 images\n")
    done = tactile("convert", tmp_path / "a.h5", tmp_path / "b.mcap", "--json")
    assert json.loads(done.stdout) == {
        "out": str(tmp_path / "b.mcap"),
        "kind": "recording",
        "written": 2,
    }


def test_a_recording_is_never_converted_onto_itself(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", 1)
    before = (tmp_path / "a.mcap").read_bytes()
    assert "already exists" in refused("convert", tmp_path / "a.mcap", tmp_path / "a.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == before


def test_a_missing_recording_is_one_sentence(tmp_path: Path) -> None:
    assert "a.mcap" in refused("convert", tmp_path / "a.mcap", tmp_path / "a.h5")
    assert list(tmp_path.iterdir()) == []


def test_an_unfinished_recording_is_converted_with_a_note(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    record(path, images=3, finished=False, bundle=False)
    done = tactile("convert", path, tmp_path / "frames")
    assert done.returncode == 0
    assert "note: a.mcap is unfinished" in done.stderr
    assert "its 3 complete images are read" in done.stderr


def test_what_ends_before_the_time_asked_for_is_said(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", 2)
    profile = tmp_path / "sensor.yaml"
    profile.write_text(SESSION.profile)
    words = "record", profile, "--input", tmp_path / "a.mcap", "--seconds", 60
    done = tactile(*words, "--out", tmp_path / "b.mcap")
    assert done.returncode == 0
    assert "note: only 2 frames in --seconds 60 came" in done.stderr
