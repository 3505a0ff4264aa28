"""One kind of recording becomes another, whole or not at all."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from itertools import permutations
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.recordings import SESSION, image, written

from tactile_core.errors import InputError, PluginError
from tactile_core.interfaces.recording_format import EventEntry, ImageEntry
from tactile_core.interfaces.recording_writer import RecordedImage
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.conversion import convert
from tactile_core.pipeline.sinks import Sinks
from tactile_core.quantities import Reference
from tactile_core.recordings.source import copy_writer, recording_file

KINDS = ("one.mcap", "one.h5", "one")

OWN = """
import json
from tactile_core.interfaces.sink import Sink

class List(Sink):
    session_ending = ".names"
    def open(self, session):
        super().open(session)
        self.names = []
        self.path = self.new_path()
    def write(self, reading):
        if "broken" in reading.source:
            raise RuntimeError("no")
        self.names.append([reading.source, len(reading.frame.raw), len(reading.quantities)])
    def close(self):
        self.path.write_text(json.dumps(self.names))
"""


def rich(path: Path, *, compressed: bool = True) -> Path:
    """Write a recording with everything that one can hold."""
    jpeg = cv2.imencode(".jpg", np.full((12, 16, 3), 90, np.uint8))[1].tobytes()
    pixels = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    writer = copy_writer(path)
    writer.open(SESSION)
    for number in range(2):
        sent = image(number, exposure_time_s=0.02, gain=1.5, sequence=number)
        if compressed:
            sent = replace(sent, pixels=pixels, encoded=jpeg)
        writer.write_image(RecordedImage(sent, number, levels={"red": 0.5}))
        name, mean = f"{number:04d}", np.full((12, 16, 3), number + 0.5, np.float32)
        writer.write_reference(name, Reference(mean, SESSION.channels))
        writer.write_event("reference", {"name": name})
        writer.write_event("measured", {"number": number, "tare": True})
    writer.write_event("press", {"depth_mm": 0.3})
    writer.close()
    return path


def content(path: Path) -> list[object]:
    """Return everything in a recording, comparable."""
    with recording_file(path) as file:
        found: list[object] = [file.session.profile, file.session.sensor, file.finished]
        for entry in file.entries:
            if isinstance(entry, EventEntry):
                found.append((entry.name, dict(entry.values)))
                if entry.name == "reference":
                    found.append(file.reference(entry.values["name"]).pixels.tobytes())
            else:
                one = file.image(entry)
                found.append((dict(entry.described), one.encoded, one.pixels.tobytes()))
        return found


@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize(("source", "out"), list(permutations(KINDS, 2)))
def test_each_kind_becomes_each_other_kind_exactly(
    tmp_path: Path, source: str, out: str, compressed: bool
) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    original = rich(tmp_path / "a" / source, compressed=compressed)
    before = content(original)
    done = convert(original, tmp_path / "b" / out)
    assert (done.kind, done.written) == ("recording", 2)
    assert content(tmp_path / "b" / out) == before
    assert content(original) == before
    assert [path.name for path in (tmp_path / "b").iterdir()] == [out]


def test_images_become_a_recording_of_their_profile(tmp_path: Path) -> None:
    profile = tmp_path / "small.yaml"
    profile.write_text(SESSION.profile)
    (tmp_path / "images").mkdir()
    for number in range(3):
        pixels = image(number).pixels
        cv2.imwrite(str(tmp_path / "images" / f"{number}.png"), pixels[..., ::-1])
    done = convert(tmp_path / "images", tmp_path / "all.h5", profile=str(profile))
    assert done.written == 3
    with recording_file(tmp_path / "all.h5") as file:
        entries = [entry for entry in file.entries if isinstance(entry, ImageEntry)]
        for number, entry in enumerate(entries):
            np.testing.assert_array_equal(file.image(entry).pixels, image(number).pixels)


def test_images_without_a_profile_are_refused(tmp_path: Path) -> None:
    (tmp_path / "images").mkdir()
    cv2.imwrite(str(tmp_path / "images" / "0.png"), image(0).pixels)
    with pytest.raises(InputError, match="name its profile with --profile"):
        convert(tmp_path / "images", tmp_path / "all.h5")
    assert not (tmp_path / "all.h5").exists()


def test_a_plugin_s_sink_is_found_by_its_ending(tmp_path: Path, install: object) -> None:
    install("own", {"names.py": OWN}, tactile_sinks={"list": "own_own.names:List"})  # type: ignore[operator]
    written(tmp_path / "a.mcap", 2)
    done = convert(tmp_path / "a.mcap", tmp_path / "b.names")
    assert (done.kind, done.written) == ("own.list", 2)
    assert (tmp_path / "b.names").read_text() == '[["a_000000", 0, 0], ["a_000001", 0, 0]]'


def test_when_a_sink_fails_nothing_is_left(tmp_path: Path, install: object) -> None:
    install("own", {"names.py": OWN}, tactile_sinks={"list": "own_own.names:List"})  # type: ignore[operator]
    written(tmp_path / "broken.mcap", 2)
    with pytest.raises(Exception, match="no"):
        convert(tmp_path / "broken.mcap", tmp_path / "b.names")
    assert [path.name for path in tmp_path.glob("*.*")] == ["broken.mcap"]


def test_a_sink_of_single_files_fills_a_folder(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", 2)
    done = convert(tmp_path / "a.mcap", tmp_path / "arrays", sink="npz", readings=True)
    assert done.written == 2
    assert sorted(path.name for path in (tmp_path / "arrays").glob("*.npz")) == [
        "a_000000.npz",
        "a_000001.npz",
    ]


def test_a_sink_that_wants_them_gets_the_camera_s_images(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[Reading] = []
    monkeypatch.setattr(Sinks, "write", lambda self, reading: taken.append(reading))
    monkeypatch.setattr(Sinks, "keeps_raw", True)
    jpeg = rich(tmp_path / "a.mcap")
    convert(jpeg, tmp_path / "arrays", sink="npz")
    assert [len(reading.frame.raw) for reading in taken] == [1, 1]
    assert taken[0].frame.raw[0].encoded is not None


@pytest.mark.parametrize("name", ["there.h5", "there", "nowhere.xyz"])
def test_what_exists_or_nothing_writes_is_refused(tmp_path: Path, name: str) -> None:
    written(tmp_path / "a.mcap", 1)
    (tmp_path / "there").mkdir()
    (tmp_path / "there.h5").write_text("mine")
    with pytest.raises(InputError, match=r"already exists|nothing writes \.xyz files"):
        convert(tmp_path / "a.mcap", tmp_path / name)
    assert (tmp_path / "there.h5").read_text() == "mine"


def test_an_unfinished_recording_becomes_a_finished_one(tmp_path: Path) -> None:
    from support.recordings import write

    path = tmp_path / "a.mcap"
    writer = copy_writer(path)
    write(writer, 3)
    assert convert(path, tmp_path / "whole.mcap").written == 3
    with recording_file(tmp_path / "whole.mcap") as file:
        assert file.finished
    writer.close()


@pytest.mark.parametrize("plugin", ["lerobot", "rerun", "rosbag"])
def test_an_absent_distribution_is_named_with_its_pip_command(tmp_path: Path, plugin: str) -> None:
    if find_spec(f"tactile_{plugin}") is not None:
        pytest.skip(f"tactile-{plugin} is installed")
    written(tmp_path / "a.mcap", 1)
    ending = {"rerun": "rrd"}.get(plugin, plugin)
    with pytest.raises(PluginError, match=rf"run 'pip install \S*tactile-{plugin}'"):
        convert(tmp_path / "a.mcap", tmp_path / f"b.{ending}")
