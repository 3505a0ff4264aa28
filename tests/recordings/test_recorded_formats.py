"""What a sensor writes is read as it was, in each format."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.command_line import refused
from support.own_plugins import Install
from support.recordings import SESSION, image, write, written

from tactile_core.errors import InputError, PluginError, PluginFault
from tactile_core.interfaces.recording_format import ImageEntry
from tactile_core.interfaces.recording_writer import RecordedImage
from tactile_core.interfaces.streaming.encoded_image import EncodedImage
from tactile_core.pipeline.conversion import convert
from tactile_core.quantities import Image, Reference
from tactile_core.recordings import source
from tactile_core.recordings.recording import open_recording
from tactile_core.recordings.recovery import recover
from tactile_core.recordings.source import copy_writer, recording_file, recording_writer

ENDINGS = (".mcap", "")
each_format = pytest.mark.parametrize("ending", ENDINGS)


def images_of(path: Path) -> list[Image]:
    with recording_file(path) as file:
        return [file.image(entry) for entry in file.entries if isinstance(entry, ImageEntry)]


@each_format
@pytest.mark.parametrize(
    "pixels",
    [
        np.arange(36, dtype=np.uint8).reshape(3, 4, 3),
        np.arange(12, dtype=np.uint8).reshape(3, 4),
        np.arange(12, dtype=np.uint16).reshape(3, 4) * 5000,
        np.arange(36, dtype=np.uint16).reshape(3, 4, 3) * 1700,
    ],
    ids=["colour", "grey", "grey 16 bits", "colour 16 bits"],
)
def test_pixels_come_back_as_they_were(tmp_path: Path, ending: str, pixels: np.ndarray) -> None:
    writer = recording_writer(tmp_path / f"one{ending}")
    writer.open(SESSION)
    writer.write_image(RecordedImage(Image(pixels), 0))
    writer.close()
    (found,) = images_of(writer.path)
    assert found.pixels.dtype == pixels.dtype
    np.testing.assert_array_equal(found.pixels, pixels)


@each_format
def test_a_jpeg_stays_the_same_bytes(tmp_path: Path, ending: str) -> None:
    jpeg = bytes(cv2.imencode(".jpg", image(1).pixels)[1])
    writer = recording_writer(tmp_path / f"one{ending}")
    writer.open(SESSION)
    writer.write_image(RecordedImage(EncodedImage(jpeg, "camera", 1.5, 2.5), 0))
    writer.close()
    if ending:
        assert images_of(writer.path)[0].encoded == jpeg
    else:
        assert (writer.path / "000000.jpg").read_bytes() == jpeg


@each_format
def test_times_keep_all_their_digits(tmp_path: Path, ending: str) -> None:
    exact = Image(
        image(1).pixels,
        timestamp_s=1 / 3 + 12345.0,
        wall_time_s=1_700_000_000.123456,
        sequence=7,
        exposure_time_s=0.1 + 0.2,
        gain=1e-17,
    )
    writer = recording_writer(tmp_path / f"one{ending}")
    writer.open(SESSION)
    writer.write_image(RecordedImage(exact, 0))
    writer.close()
    (found,) = images_of(writer.path)
    names = ("timestamp_s", "wall_time_s", "sequence", "exposure_time_s", "gain")
    assert [getattr(found, n) for n in names] == [getattr(exact, n) for n in names]


@each_format
@pytest.mark.parametrize(
    ("times_s", "stuck"),
    [((0.0, 0.1, 5.0), 0), ((0.0, 0.0, 0.1), 1), ((2.0, 1.0, 1.1), 1), ((-3.0, -2.0, -2.0), 1)],
)
def test_times_that_do_not_rise_are_said(
    tmp_path: Path, ending: str, times_s: tuple[float, ...], stuck: int
) -> None:
    writer = recording_writer(tmp_path / f"one{ending}")
    writer.open(SESSION)
    for number, time_s in enumerate(times_s):
        one = replace(image(number, sequence=number), timestamp_s=time_s)
        writer.write_image(RecordedImage(one, number))
    writer.close()
    said = [
        note for note in open_recording(writer.path).source.notes if "not after the one" in note
    ]
    assert [note[:7] for note in said] == ([f"{stuck} of 3 "] if stuck else [])


@pytest.mark.parametrize("value", ["Infinity", "-Infinity", "NaN", "1e300"])
def test_a_time_that_is_no_time_is_damage(tmp_path: Path, value: str) -> None:
    writer = recording_writer(tmp_path / "one")
    writer.open(SESSION)
    writer.write_image(RecordedImage(replace(image(0), timestamp_s=0.125), 0))
    writer.close()
    listed = tmp_path / "one" / "recording.jsonl"
    text = listed.read_text().replace('"timestamp_s": 0.125', f'"timestamp_s": {value}')
    assert value in text
    listed.write_text(text)
    with pytest.raises(InputError, match="damaged description"):
        list(open_recording(tmp_path / "one").source.images())


@each_format
def test_the_session_comes_back(tmp_path: Path, ending: str) -> None:
    pixels = np.random.default_rng(1).random((12, 16, 3), np.float32)
    reference = Reference(pixels, SESSION.channels, noise=0.5, frames=3, relative=True)
    session = replace(
        SESSION,
        serial="0007",
        gel="g1",
        sim=True,
        bundle={"manifest.json": b"{}", "light/model.npz": b"\0\1"},
        reference=reference,
        software={"tactile-core": "1"},
        started="2026-01-01T00:00:00+00:00",
        tared=True,
    )
    writer = recording_writer(tmp_path / f"one{ending}")
    writer.open(session)
    writer.close()
    with recording_file(writer.path) as file:
        found = file.session
    assert found.reference is not None
    np.testing.assert_array_equal(found.reference.pixels, pixels)
    assert (found.reference.noise, found.reference.relative) == (0.5, True)
    assert replace(found, reference=None).__dict__ == replace(session, reference=None).__dict__


def test_a_recording_cut_at_any_byte_has_every_image_that_is_complete(tmp_path: Path) -> None:
    images = written(tmp_path / "whole.mcap", 5)
    data = (tmp_path / "whole.mcap").read_bytes()
    ends = [data.index(one.pixels.tobytes()) + one.pixels.nbytes for one in images]
    cut = tmp_path / "cut.mcap"
    rng = np.random.default_rng(0)
    beginning = data.index(images[0].pixels.tobytes())
    for size in [*rng.integers(beginning, len(data), 60).tolist(), *ends, ends[0] - 1]:
        cut.write_bytes(data[:size])
        complete = sum(end <= size for end in ends)
        with recording_file(cut) as file:
            found = [file.image(e) for e in file.entries if isinstance(e, ImageEntry)]
        assert len(found) == complete
        for one, other in zip(found, images, strict=False):
            np.testing.assert_array_equal(one.pixels, other.pixels)


def test_a_recording_cut_before_its_first_image_is_refused_in_a_sentence(tmp_path: Path) -> None:
    written(tmp_path / "whole.mcap", 1)
    data = (tmp_path / "whole.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    for size in (0, 3, 8, 20, 60, 200):
        cut.write_bytes(data[:size])
        with pytest.raises(InputError, match=r"cut\.mcap"):
            open_recording(cut)


def test_what_is_recovered_opens_with_its_index_in_the_library_of_the_format(
    tmp_path: Path,
) -> None:
    from mcap.reader import make_reader

    images = written(tmp_path / "whole.mcap", 5)
    data = (tmp_path / "whole.mcap").read_bytes()
    end = data.index(images[3].pixels.tobytes()) + 10
    (tmp_path / "cut.mcap").write_bytes(data[:end])
    found = recover(tmp_path / "cut.mcap")
    with found.path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == found.messages
        assert summary.statistics.chunk_count == found.images
    recovered = images_of(found.path)
    assert [one.sequence for one in recovered] == [0, 1, 2]
    with pytest.raises(InputError, match="already exists"):
        recover(tmp_path / "cut.mcap")
    with pytest.raises(InputError, match="nothing to recover"):
        recover(found.path)


def test_the_library_of_the_format_and_foxgloves_schemas_read_every_image(tmp_path: Path) -> None:
    from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
    from mcap.reader import make_reader

    images = written(tmp_path / "one.mcap", 3)
    with (tmp_path / "one.mcap").open("rb") as file:
        reader = make_reader(file)
        found = [
            RawImage.FromString(message.data)
            for schema, _, message in reader.iter_messages(topics=["/tactile/small/camera"])
            if schema is not None and schema.name == "foxglove.RawImage"
        ]
    assert [(one.width, one.height, one.encoding) for one in found] == 3 * [(16, 12, "rgb8")]
    assert [one.data for one in found] == [one.pixels.tobytes() for one in images]


@pytest.mark.parametrize("compression", ["LZ4", "ZSTD"])
def test_a_recording_that_another_program_compressed_is_read(
    tmp_path: Path, compression: str
) -> None:
    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer

    images = written(tmp_path / "one.mcap", 3)
    with (tmp_path / "one.mcap").open("rb") as file, (tmp_path / "new.mcap").open("wb") as out:
        reader, writer = make_reader(file), Writer(out, compression=CompressionType[compression])
        writer.start()
        for one in reader.iter_attachments():
            writer.add_attachment(0, 0, one.name, one.media_type, one.data)
        channels: dict[str, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert schema is not None
            if channel.topic not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(
                    channel.topic, channel.message_encoding, number
                )
            writer.add_message(channels[channel.topic], 0, message.data, 0, message.sequence)
        writer.finish()
    for one, other in zip(images_of(tmp_path / "new.mcap"), images, strict=True):
        np.testing.assert_array_equal(one.pixels, other.pixels)


def test_another_process_reads_what_is_being_written(tmp_path: Path) -> None:
    writer = recording_writer(tmp_path / "growing.mcap")
    write(writer, 4)
    recording = open_recording(tmp_path / "growing.mcap")
    assert recording.recorded is not None
    assert len(list(recording)) == 4
    assert "still being written" in recording.recorded.notes[0]
    writer.close()


@pytest.mark.parametrize("name", ["there.mcap", "there.avi", "no/folder.mcap"])
def test_a_place_that_cannot_be_recorded_to_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "there.mcap").touch()
    with pytest.raises(InputError, match=r"name another|ends in"):
        recording_writer(tmp_path / name)


OWN = """
from tactile_core.interfaces.recording_format import RecordingFormat
from tactile_core.recordings.folder.file import FolderFile, FolderWriter

class Own(RecordingFormat):
    def write(self, path):
        return FolderWriter(path)
    def read(self, path):
        if (path / "broken").exists():
            raise RuntimeError("no")
        return FolderFile(path)
"""


def test_a_plugin_s_format_is_found_by_its_ending(tmp_path: Path, install: Install) -> None:
    install("lab", {"own.py": OWN}, tactile_recording_formats={"own": "own_lab.own:Own"})
    written(tmp_path / "a.mcap", 2)
    convert(tmp_path / "a.mcap", tmp_path / "b.own")
    for one, other in zip(
        images_of(tmp_path / "b.own"), images_of(tmp_path / "a.mcap"), strict=True
    ):
        np.testing.assert_array_equal(one.pixels, other.pixels)
    with pytest.raises(InputError, match=r"'tactile convert'; record c\.mcap first"):
        recording_writer(tmp_path / "c.own")
    (tmp_path / "b.own" / "broken").touch()
    with pytest.raises(PluginFault, match=r"'lab\.own' .*tactile-lab"):
        recording_file(tmp_path / "b.own")


FAULTY = """
from tactile_core.interfaces.recording_format import RecordingFormat
from tactile_core.recordings.folder.file import FolderFile, FolderWriter

class File(FolderFile):
    def image(self, entry):
        return {}["image"]

class Writer(FolderWriter):
    def write_image(self, recorded):
        raise ZeroDivisionError

class Unreadable(RecordingFormat):
    def write(self, path):
        return FolderWriter(path)
    def read(self, path):
        return File(path)

class Unwritable(Unreadable):
    def write(self, path):
        return Writer(path)
    def read(self, path):
        return None

class Nothing(Unreadable):
    def write(self, path):
        return None
"""


def test_a_fault_of_a_plugin_s_format_names_the_plugin(tmp_path: Path, install: Install) -> None:
    kinds = {
        name.lower(): f"own_lab.own:{name}" for name in ("Unreadable", "Unwritable", "Nothing")
    }
    install("lab", {"own.py": FAULTY}, tactile_recording_formats=kinds)
    written(tmp_path / "a.mcap", 2)
    convert(tmp_path / "a.mcap", tmp_path / "b.unreadable")
    (tmp_path / "b.unwritable").mkdir()
    for cause, use in {
        r"KeyError: 'image'": lambda: convert(tmp_path / "b.unreadable", tmp_path / "c.mcap"),
        r"KeyError: '.*'": lambda: open_recording(tmp_path / "b.unreadable"),
        "ZeroDivisionError": lambda: convert(tmp_path / "a.mcap", tmp_path / "c.unwritable"),
        "NoneType, not a RecordingFile": lambda: recording_file(tmp_path / "b.unwritable"),
        "NoneType, not a RecordingWriter": lambda: copy_writer(tmp_path / "c.nothing"),
    }.items():
        with pytest.raises(PluginFault, match=rf"tactile-lab 1\.0\) .*{cause}"):
            use()


def test_a_format_whose_distribution_is_absent_is_named_with_its_pip_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(source, "_BROUGHT", {".xyz": "elsewhere.xyz"})
    (tmp_path / "b.xyz").touch()
    for use in (
        lambda: recording_file(tmp_path / "b.xyz"),
        lambda: copy_writer(tmp_path / "c.xyz"),
    ):
        with pytest.raises(PluginError, match=r"'elsewhere\.xyz' .*pip install tactile-elsewhere"):
            use()


def test_a_missing_recording_is_missing_also_if_its_format_is_absent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(source, "_BROUGHT", {".h5": "elsewhere.h5"})
    with pytest.raises(InputError, match=r"a\.h5: there is no such file"):
        recording_file(tmp_path / "a.h5")
    for out in ("b.mcap", "b.rosbag"):
        assert "there is no such file" in refused("convert", tmp_path / "a.h5", tmp_path / out)
    assert "there is no such file" in refused("run", "hex_fingertip", "--input", tmp_path / "a.h5")


def test_hdf5_is_no_format_of_live_recordings(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'tactile convert'; record a\.mcap first"):
        recording_writer(tmp_path / "a.h5")
