"""``tactile run`` with several recordings."""

from __future__ import annotations

import json
from pathlib import Path

from support.command_line import refused, tactile
from support.many_recordings import many_recordings
from support.virtual_lab import VirtualLab


def test_each_recording_has_a_folder_and_a_line(lab: VirtualLab, tmp_path: Path) -> None:
    inputs = many_recordings(lab, tmp_path / "recordings")
    words = ["run", lab.profile_path, "--input", inputs, "--bundle", lab.bundle]
    done = tactile(*words, "--out", tmp_path / "out", "--save", "tmd")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.partition(",")[0] for line in lines] == [
        "lift_1: 3 observations",
        "lift_2: 3 observations",
    ]
    files = sorted(str(path.relative_to(tmp_path / "out")) for path in tmp_path.glob("out/*/*.tmd"))
    assert files == [f"lift_{i}/f00{j}.tmd" for i in (1, 2) for j in range(3)]
    again = tactile(*words, "--out", tmp_path / "out", "--save", "tmd")
    assert [line.endswith("measured before") for line in again.stdout.splitlines()] == [True, True]


def test_json_lines_name_the_recording(lab: VirtualLab, tmp_path: Path) -> None:
    inputs = many_recordings(lab, tmp_path / "recordings")
    words = ["--input", inputs / "lift_2", "--input", inputs / "lift_1", "--json"]
    done = tactile("run", lab.profile_path, *words, "--bundle", lab.bundle)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [(line["recording"], line["source"]) for line in lines] == [
        (name, f"f00{frame}") for name in ("lift_2", "lift_1") for frame in range(3)
    ]


def test_broken_recordings_are_reported_at_the_end(lab: VirtualLab, tmp_path: Path) -> None:
    inputs = many_recordings(lab, tmp_path / "recordings")
    (inputs / "cut.mp4").write_bytes(b"no video")
    words = ["run", lab.profile_path, "--input", inputs, "--bundle", lab.bundle]
    done = tactile(*words, "--out", tmp_path / "out")
    assert done.returncode == 1
    assert len(done.stdout.splitlines()) == 2
    head, reason = done.stderr.splitlines()[-2:]
    assert head == "tactile: 1 of 3 recordings could not be measured and are left out:"
    assert "cut: " in reason
    assert "not a readable video" in reason
    assert (tmp_path / "out" / "lift_2" / "measured.json").is_file()


def test_what_belongs_to_one_recording_is_refused_for_several(
    lab: VirtualLab, tmp_path: Path
) -> None:
    inputs = many_recordings(lab, tmp_path / "recordings", frames=1)
    words = ["run", lab.profile_path, "--bundle", lab.bundle]
    assert "--external" in refused(*words, "--input", inputs, "--external", tmp_path)
    one = ["--input", inputs / "lift_1"]
    assert "several recordings" in refused(*words, *one, "--cluster", "tcp://127.0.0.1:1")
    both = ["--workers", 2, "--cluster", "tcp://127.0.0.1:1"]
    assert "either workers or a cluster" in refused(*words, "--input", inputs, *both)
    assert "--input" in refused(*words, "--input", inputs, "--out", inputs)


def test_a_folder_of_images_with_a_video_in_it_is_read_with_a_note(
    lab: VirtualLab, tmp_path: Path
) -> None:
    folder = many_recordings(lab, tmp_path / "recordings") / "lift_1"
    (folder / "slide.mp4").write_bytes(b"")
    words = ["run", lab.profile_path, "--input", folder, "--bundle", lab.bundle]
    done = tactile(*words)
    assert done.returncode == 0
    assert "slide.mp4 in it is not measured" in done.stderr
    assert len(done.stdout.splitlines()) == 3
