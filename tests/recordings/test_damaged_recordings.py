"""Of a damaged recording, everything sound and nothing else is read, and a sentence says so."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from support.command_line import refused, tactile
from support.damaged_recordings import chunks_in, damaged, images_in, record
from support.recordings import SESSION, image, written
from support.virtual_lab import VirtualLab

from tactile_core.errors import InputError
from tactile_core.interfaces.recording_format import EventEntry, ImageEntry
from tactile_core.interfaces.recording_writer import RecordedImage
from tactile_core.pipeline.conversion import convert
from tactile_core.recordings.mcap.records import RECORD, McapRecords
from tactile_core.recordings.mcap.writer import McapWriter
from tactile_core.recordings.recorded_source import RecordedSource
from tactile_core.recordings.recording import open_recording
from tactile_core.recordings.recovery import recover
from tactile_core.recordings.session_files import bundle_of, own_reference
from tactile_core.recordings.source import recording_file


def flipped(path: Path, at: int, bit: int = 4) -> None:
    data = bytearray(path.read_bytes())
    data[at] ^= bit
    path.write_bytes(data)


def middle_of_image(path: Path, number: int) -> int:
    """Return the offset of a pixel of a small image."""
    data = path.read_bytes()
    return data.index(image(number).pixels.tobytes()) + 100


@pytest.mark.parametrize("finished", [True, False])
def test_a_flipped_bit_costs_its_own_image_at_most_and_alters_nothing(
    tmp_path: Path, finished: bool
) -> None:
    path, bad = tmp_path / "whole.mcap", tmp_path / "bad.mcap"
    record(path, images=20, finished=finished)
    data, sent = path.read_bytes(), images_in(path)
    chunks = list(chunks_in(data, sent))
    with recording_file(path) as file:
        begun, later = file.session.reference, file.reference("0010")
        assert begun is not None
    rng = np.random.default_rng(0)
    places = rng.integers(0, len(data), 25).tolist()
    # kind, length, time, size and checksum of a chunk, length of its content, and its first record
    places += [chunks[1][1] + at for at in (0, 1, 9, 25, 33, 41, 48, 49)]
    for at in places:
        bad.write_bytes(damaged(data, at, at + 1, 1 << int(rng.integers(8))))
        found = images_in(bad)
        assert {n for n, begin, end in chunks if not begin <= at < end} <= set(found)
        assert all(found[number] == sent[number] for number in found)
        with recording_file(bad) as file:
            own = file.session.reference
            assert own is not None or file.session.damaged == ("reference",)
            assert own is None or own.pixels.tobytes() == begun.pixels.tobytes()
            with suppress(InputError):  # it is missing
                assert file.reference("0010").pixels.tobytes() == later.pixels.tobytes()


@pytest.mark.parametrize("finished", [True, False])
@pytest.mark.parametrize("begin", [0.0, 0.2, 0.5])
def test_half_a_file_of_zeros_costs_that_half(tmp_path: Path, begin: float, finished: bool) -> None:
    path, bad = tmp_path / "whole.mcap", tmp_path / "bad.mcap"
    record(path, images=30, finished=finished)
    data, sent = path.read_bytes(), images_in(path)
    first = int(begin * len(data))
    last = first + len(data) // 2
    bad.write_bytes(damaged(data, first, last, 0))
    kept = {n for n, start, end in chunks_in(data, sent) if end <= first or start >= last}
    found = images_in(bad)
    assert set(found) == kept
    assert all(found[number] == sent[number] for number in found)
    again = images_in(recover(bad).path)
    assert again == found


def test_commands_say_in_a_sentence_how_much_was_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, 4)
    flipped(path, middle_of_image(path, 2))
    words = "a.mcap is damaged: 1 of its 4 chunks are left out, with 1 of 4 images"
    done = tactile("convert", path, tmp_path / "b.h5")
    assert (done.returncode, done.stdout) == (0, f"{tmp_path / 'b.h5'}: 3 images\n")
    assert done.stderr.count(words) == 1
    done = tactile("recover", path)
    assert (done.returncode, done.stderr.count(words)) == (0, 1)
    assert done.stdout.endswith("3 images\n")
    profile = tmp_path / "small.yaml"
    profile.write_text(SESSION.profile)
    done = tactile("run", profile, "--input", path, "--reference", "first", "--json")
    assert (done.returncode, done.stderr.count(words)) == (0, 1)
    assert [json.loads(line)["sequence"] for line in done.stdout.splitlines()] == [0, 1, 2]
    done = tactile("record", profile, "--input", path, "--out", tmp_path / "c.mcap")
    assert (done.returncode, done.stderr.count(words)) == (0, 1)
    whole = refused("recover", tmp_path / "a.recovered.mcap")
    assert "is complete; there is nothing to recover" in whole


def test_places_of_an_unfinished_recording_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    record(path, images=6, finished=False, bundle=False)
    for number in (0, 4):
        flipped(path, middle_of_image(path, number))
    with recording_file(path) as file:
        assert file.damage.startswith("a.mcap is damaged in 2 places: the images there are left")
        assert file.damage.endswith("; 4 are read")
    found = recover(path)
    assert found.images == 4
    with recording_file(found.path) as file:
        assert (file.finished, file.damage) == (True, "")


def test_after_a_damaged_place_tracking_starts_again(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    record(path, images=6, bundle=False)
    flipped(path, middle_of_image(path, 2))
    for one in (path, recover(path).path):
        with recording_file(one) as file:
            turns = RecordedSource(file, 1).turns
        assert [number for number, turn in turns.items() if turn.resumed] == [2]


def test_a_new_reference_counts_although_its_event_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    record(path, images=13, bundle=False)
    flipped(path, path.read_bytes().index(b'{"name": "0010"}'))
    for one in (path, recover(path).path):
        with recording_file(one) as file:
            turns = RecordedSource(file, 1).turns
            assert turns[11].reference == "0010"
            assert file.reference("0010").pixels.mean() > 10


def with_damaged(path: Path, name: bytes) -> Path:
    """Flip a bit of the last byte of an attachment."""
    data = path.read_bytes()
    named = data.index(len(name).to_bytes(4, "little") + name)
    begin = data.rindex(b"\x09", 0, named - 20)
    while begin + RECORD.size + 16 != named:
        begin = data.rindex(b"\x09", 0, begin)
    length = RECORD.unpack_from(data, begin)[1]
    flipped(path, begin + RECORD.size + length - 10)
    return path


def test_a_damaged_reference_is_never_replaced_in_silence(lab: VirtualLab, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    tactile(
        *("record", lab.profile_path, "--input", lab.presses, "--bundle", lab.bundle),
        *("--reference", lab.reference, "--frames", 2, "--out", path),
    )
    with_damaged(path, b"reference.npz")
    message = refused("run", lab.profile_path, "--input", path)
    assert "the reference in" in message
    assert "is damaged; give --reference" in message
    done = tactile("run", lab.profile_path, "--input", path, "--reference", lab.reference)
    assert done.returncode == 0
    assert "the reference in a.mcap is damaged and left out" in done.stderr
    assert "the reference in" in refused(
        "calibrate", lab.profile_path, "--presses", path, "--out", tmp_path / "b"
    )
    # a copy is sound as a file, and still says so
    convert(path, tmp_path / "b.h5")
    assert "is damaged; give --reference" in refused(
        "run", lab.profile_path, "--input", tmp_path / "b.h5"
    )


def test_a_damaged_bundle_is_never_replaced_in_silence(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    record(path, images=2)
    with_damaged(path, b"bundle/light/model.npz")
    with recording_file(path) as file:
        assert file.session.damaged == ("bundle",)
        assert file.session.bundle is None
        assert own_reference(file.session, path) is not None
        with pytest.raises(InputError, match=r"the bundle in .* is damaged; give --bundle"):
            bundle_of(file.session, path)


def test_a_chunk_that_claims_more_than_memory_holds_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.mcap"
    written(path, 3)
    data = path.read_bytes()
    ((_, begin, end), *_) = chunks_in(data, images_in(path))
    monkeypatch.setattr("tactile_core.recordings.mcap.records._MOST_BYTES", 1 << 22)
    huge = 3 << 22
    header = bytearray(data[begin:end][: RECORD.size + 40])
    header[1:9] = (40 + huge).to_bytes(8, "little")
    header[-8:] = huge.to_bytes(8, "little")
    path.write_bytes(data[:begin] + header)
    os.truncate(path, begin + len(header) + huge)  # a sparse file
    with path.open("ab") as file:
        file.write(data[end:])
    longest = []
    read = McapRecords.read_at
    monkeypatch.setattr(
        McapRecords, "read_at", lambda *given: longest.append(given[2]) or read(*given)
    )
    assert sorted(images_in(path)) == [1, 2]
    assert max(longest) < huge


def test_what_is_not_the_camera_s_is_no_image(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = McapWriter(path)
    writer.open(SESSION)
    sent = RecordedImage(image(0), 7)
    writer.write_image(sent)
    info = json.dumps(sent.describe_image()).encode()
    writer.add("camera/info", "tactile.ImageInfo", 1, info, 8)
    writer.add("quantities/camera", "foxglove.RawImage", 1, b"", 8)
    writer.add("notes", "tactile.Event2", 1, b"{}", 8)
    writer.complete_chunk()
    writer.close()
    with recording_file(path) as file:
        assert [e.described["number"] for e in file.entries if isinstance(e, ImageEntry)] == [7]
        assert not [e for e in file.entries if isinstance(e, EventEntry)]


def test_log_times_are_those_of_the_wall_clock(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    written(tmp_path / "a.mcap", 2)
    with (tmp_path / "a.mcap").open("rb") as file:
        times_ns = [
            m.log_time for _, c, m in make_reader(file).iter_messages() if "info" in c.topic
        ]
    assert times_ns == [round(1e18), round(1e18 + 1e8)]


def test_what_follows_the_end_is_no_part_of_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, 3)
    data = path.read_bytes()
    end = data.index(b"\x0f\x04\0\0\0\0\0\0\0")
    chunks = list(chunks_in(data, images_in(path)))
    _, begin, last = chunks[0]
    path.write_bytes(data[: end + 13] + data[begin:last])
    assert sorted(images_in(path)) == [0, 1, 2]
    with recording_file(path) as file:
        assert len(file.entries) == 3


def test_a_damaged_summary_makes_a_recording_unfinished(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, 3)
    flipped(path, path.stat().st_size - 100)
    with recording_file(path) as file:
        assert not file.finished
    assert sorted(images_in(path)) == [0, 1, 2]
    assert recover(path).images == 3


def test_chunks_without_a_checksum_are_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path, 2)
    data = bytearray(path.read_bytes())
    (_, begin, _), _ = chunks_in(bytes(data), images_in(path))
    data[begin + RECORD.size + 24 : begin + RECORD.size + 28] = bytes(4)
    path.write_bytes(data)
    assert sorted(images_in(path)) == [1]


def text(path: Path) -> None:
    path.write_text("this is no recording\n" * 50)


def nothing(path: Path) -> None:
    path.write_bytes(b"")


def without_session(path: Path) -> None:
    written(path, 2)
    path.write_bytes(path.read_bytes().replace(b"exposures", b"exp0sures"))


@pytest.mark.parametrize("make", [text, nothing, without_session])
def test_what_is_no_recording_is_refused_in_a_sentence(
    tmp_path: Path, make: Callable[[Path], None]
) -> None:
    make(tmp_path / "a.mcap")
    with pytest.raises(InputError, match=r"a\.mcap"):
        open_recording(tmp_path / "a.mcap")


def test_a_recording_that_stays_as_it_is_is_verified_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, reads = tmp_path / "a.mcap", []
    read = McapRecords.read_at
    monkeypatch.setattr(McapRecords, "read_at", lambda *given: reads.append(given) or read(*given))
    record(path, images=8)
    before_s = path.stat().st_mtime - 10
    monkeypatch.setattr("time.time", lambda: before_s + 20)
    counts = []
    for _ in range(3):
        reads.clear()
        sent = images_in(path)
        counts.append(len(reads))
    assert counts[0] > 2 * counts[1] == 2 * counts[2]
    with recording_file(path) as file:
        assert (file.finished, file.session.sensor) == (True, "small")
    flipped(path, middle_of_image(path, 2))
    assert sorted(images_in(path)) == sorted(set(sent) - {2})


def test_an_image_that_changes_after_opening_is_refused(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", 20)
    recording = open_recording(tmp_path / "a.mcap")
    os.truncate(tmp_path / "a.mcap", 100)
    with pytest.raises(InputError, match="has changed while it was read"):
        list(recording)
