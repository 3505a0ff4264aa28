"""HDF5 recordings whose writer was killed, or whose end is missing, are read as far as they go."""

from __future__ import annotations

import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command_line import refused, tactile
from support.readings import SHAPE, contact, height, markers, reading
from support.recordings import SESSION, image

from tactile_core.errors import InputError
from tactile_core.formats.saved_quantities import quantities_in
from tactile_core.quantities import HeightMap, Image, MarkerField, Reference
from tactile_core.recordings.hdf5.file import Hdf5File
from tactile_core.recordings.hdf5.incomplete_file import lookup3
from tactile_core.recordings.hdf5.writer import Hdf5Writer
from tactile_core.recordings.recorder import RecordedImage
from tactile_core.recordings.recording import open_recording
from tactile_core.recordings.recording_file import EventEntry, ImageEntry
from tactile_core.recordings.recovery import recover

h5py = pytest.importorskip("h5py")

IMAGES, FIRST_READING = 14, 6


def sent(number: int) -> Image:
    rng = np.random.default_rng(number)
    return replace(image(number), pixels=rng.integers(0, 256, (60, 80, 3), np.uint8))


def write(path: Path, *, close: bool = True) -> Hdf5Writer:
    """Write images, later readings too, and a reference between them."""
    writer = Hdf5Writer(path)
    writer.open(SESSION)
    for number in range(IMAGES):
        writer.write_image(RecordedImage(sent(number), number, levels={"red": 0.5}))
        writer.write_event("measured", {"number": number})
        if number == 4:
            pixels = np.full((*SHAPE, 3), 7.5, np.float32)
            writer.write_reference("second", Reference(pixels, SESSION.channels))
        if number >= FIRST_READING:
            writer.write_reading(reading(height(number / 100), contact(), markers()))
        if number % 3 == 2:
            writer.flush()
    writer.close() if close else writer.flush()
    return writer


def assert_the_beginning(path: Path) -> tuple[int, int]:
    """Check that everything that is read is what was written; return images and readings."""
    with Hdf5File(path) as file:
        images = [entry for entry in file.entries if isinstance(entry, ImageEntry)]
        for number, entry in enumerate(images):
            assert entry.described["levels"] == {"red": 0.5}
            np.testing.assert_array_equal(file.image(entry).pixels, sent(number).pixels)
        for number in range(file.readings):
            back = quantities_in(file.reading_arrays(number), HeightMap, MarkerField)
            assert back[HeightMap].mm[0, 0] == np.float32((FIRST_READING + number) / 100)
            assert len(back[MarkerField].px) == 2
            assert "max_height_mm" in file.reading_line(number)
        return len(images), file.readings


def test_a_recording_that_is_cut_anywhere_is_read_to_there(tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole.h5", tmp_path / "cut.h5"
    write(whole)
    data = whole.read_bytes()
    counts = []
    for size in np.linspace(0, len(data) - 1, 60).astype(int):
        cut.write_bytes(data[:size])
        if size < len(data) / 100:  # not even the profile is there
            with pytest.raises(InputError, match=r"cut\.h5"):
                assert_the_beginning(cut)
        else:
            counts.append(assert_the_beginning(cut))
    assert counts == sorted(counts)
    assert counts[-1][0] >= IMAGES - 1
    assert len({images for images, _ in counts}) > IMAGES / 2


def test_what_was_cut_off_is_recovered_to_a_file_that_plain_h5py_opens(tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole.h5", tmp_path / "cut.h5"
    write(whole)
    cut.write_bytes(whole.read_bytes()[: int(0.9 * whole.stat().st_size)])
    images, readings = assert_the_beginning(cut)
    found = recover(cut)
    assert found.path == tmp_path / "cut.recovered.h5"
    assert found.images == images > 0
    assert assert_the_beginning(found.path) == (images, readings)
    with Hdf5File(found.path) as file:
        assert file.finished
        events = [entry for entry in file.entries if isinstance(entry, EventEntry)]
        assert found.messages == images + len(events) + readings
        assert file.reference("second").pixels[0, 0, 0] == 7.5
        assert file.session.profile == SESSION.profile
    with h5py.File(found.path) as plain:
        assert plain["images/pixels"].shape == (images, 60, 80, 3)
        assert plain["images/pixels"].compression == "gzip"
        assert plain["images/timestamp_s"].attrs["unit"] == "s"
        assert plain["readings/height_mm"].attrs["unit"] == "mm"
        rows = plain["reading_of/markers_px"][:]
        assert rows.tolist() == [number for number in range(readings) for _ in range(2)]


_KILLED = """
import os, signal, sys
from pathlib import Path
sys.path[:0] = [sys.argv[2]]
from recordings.hdf5.test_interrupted import *
from tactile_core.recordings.hdf5.growing_file import GrowingFile

writer = write(Path(sys.argv[1]), close=False)
made = []
create = GrowingFile._create
def killed(self, name, column):
    create(self, name, column)
    made.append(name)
    if len(made) == int(sys.argv[3]):
        os.kill(os.getpid(), signal.SIGKILL)
GrowingFile._create = killed
writer.write_image(RecordedImage(sent(99), 99, levels={"a new light": 1.0, "another": 1.0}))
writer.flush()
"""


@pytest.mark.parametrize("columns", [1, 2])
def test_a_kill_while_columns_are_made_loses_nothing_that_was_flushed(
    tmp_path: Path, columns: int
) -> None:
    path, tests = tmp_path / "a.h5", Path(__file__).parents[2]
    words = [sys.executable, "-c", _KILLED, path, tests, str(columns)]
    assert subprocess.run(words, check=False).returncode == -signal.SIGKILL
    assert assert_the_beginning(path) == (IMAGES, IMAGES - FIRST_READING)
    found = recover(path)
    assert assert_the_beginning(found.path) == (IMAGES, IMAGES - FIRST_READING)


def test_a_truncated_recording_is_measured_and_recovered_by_command(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write(path)
    path.write_bytes(path.read_bytes()[: int(0.8 * path.stat().st_size)])
    recording = open_recording(path)
    assert recording.recorded is not None
    assert "unfinished" in recording.recorded.notes[0]
    done = tactile("recover", path, "--json")
    assert done.returncode == 0, done.stderr
    assert '"images": ' in done.stdout
    assert "already exists" in refused("recover", path)
    assert "nothing to recover" in refused("recover", tmp_path / "a.recovered.h5")
    assert "end it in .h5" in refused("recover", path, "--out", tmp_path / "b.mcap")
    assert "is a folder" in refused("recover", tmp_path)
    (tmp_path / "notes.txt").touch()
    path.write_bytes(path.read_bytes()[:20_000])
    assert "has no complete image" in refused("recover", path, "--out", tmp_path / "b.h5")
    assert not (tmp_path / "b.h5").exists()
    path.write_bytes(path.read_bytes()[:5_000])
    assert "ends before its first image" in refused("recover", path, "--out", tmp_path / "b.h5")
    assert "is no recording" in refused("recover", tmp_path / "notes.txt")


def test_the_checksum_is_that_of_its_author() -> None:
    assert lookup3(b"") == 0xDEADBEEF
    assert lookup3(b"Four score and seven years ago") == 0x17770551
