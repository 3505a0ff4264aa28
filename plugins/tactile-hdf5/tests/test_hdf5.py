"""Recordings and readings in HDF5, read back with plain ``h5py`` and as recordings."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import h5py
import numpy as np
import pytest
from support.readings import SHAPE, contact, height, markers, reading, slopes

from tactile_core.errors import InputError
from tactile_core.formats.npz import DESCRIPTION, quantities_in
from tactile_core.interfaces.recording_format import EventEntry, ImageEntry
from tactile_core.interfaces.recording_writer import RecordedImage, RecordedSession
from tactile_core.quantities import (
    Image,
    MarkerField,
    Reference,
    SlipState,
)
from tactile_hdf5.recordings import Hdf5File, Hdf5Writer

HERE = Path(__file__).parent

SESSION = RecordedSession(
    profile="name: bench\n",
    sensor="bench 0007",
    channels=("red", "green", "blue"),
    serial="0007",
    bundle={"manifest.json": b"{}", "light/model.npz": b"\x00\xff"},
    software={"tactile-core": "0.1.0"},
    started="2026-11-23T08:00:00Z",
)


def image(number: int, **changes: Any) -> RecordedImage:
    rng = np.random.default_rng(number)
    made = Image(
        rng.integers(0, 255, (*SHAPE, 3), np.uint8),
        timestamp_s=number / 3,
        wall_time_s=1.7e9 + number / 3,
        sequence=number,
    )
    return replace(RecordedImage(made, number), **changes)


def jpeg(number: int) -> RecordedImage:
    pixels = np.full((16, 16, 3), 10 * number, np.uint8)
    encoded = cv2.imencode(".jpg", pixels)[1].tobytes()
    return RecordedImage(Image(cv2.imdecode(np.frombuffer(encoded, "u1"), 1), encoded=encoded), 0)


def written(path: Path, *images: RecordedImage) -> Path:
    writer = Hdf5Writer(path)
    writer.open(SESSION)
    for one in images:
        writer.write_image(one)
    writer.close()
    return path


def images_of(file: Hdf5File) -> list[Image]:
    return [file.image(entry) for entry in file.entries if isinstance(entry, ImageEntry)]


def test_pixels_and_what_the_camera_reported_come_back_exactly(tmp_path: Path) -> None:
    sent = [image(0), image(5, observation=2, exposure_index=1, levels={"red": 0.3})]
    sent[1] = replace(sent[1], image=replace(sent[1].image, exposure_time_s=0.01, gain=2.5))  # type: ignore[type-var]
    file = Hdf5File(written(tmp_path / "a.h5", *sent))
    assert file.finished
    for entry, one in zip(file.entries, sent, strict=True):
        assert isinstance(entry, ImageEntry)
        assert entry.described == one.describe_image()
        assert isinstance(one.image, Image)
        back = file.image(entry)
        np.testing.assert_array_equal(back.pixels, one.image.pixels)
        assert back.timestamp_s == one.image.timestamp_s
        assert back.encoded is None


def test_compressed_images_stay_the_camera_s_own_bytes(tmp_path: Path) -> None:
    sent = [jpeg(1), image(0), jpeg(2)]
    back = images_of(Hdf5File(written(tmp_path / "a.h5", *sent)))
    assert [one.encoded for one in back] == [one.image.encoded for one in sent]
    assert isinstance(sent[2].image, Image)
    np.testing.assert_array_equal(back[2].pixels, sent[2].image.pixels[..., ::-1])


def test_the_session_comes_back(tmp_path: Path) -> None:
    file = Hdf5File(written(tmp_path / "a.h5", image(0)))
    assert file.session == replace(SESSION) or vars(file.session) == vars(SESSION)


def test_events_and_references_stay_in_their_place(tmp_path: Path) -> None:
    path, pixels = tmp_path / "a.h5", np.full((*SHAPE, 3), 7.5, np.float32)
    writer = Hdf5Writer(path)
    writer.open(SESSION)
    writer.write_event("resumed", {})
    writer.write_image(image(0))
    writer.write_reference("second", Reference(pixels, SESSION.channels))
    writer.write_event("reference", {"name": "second"})
    writer.write_event("measured", {"number": 0, "tare": True})
    writer.write_image(image(1))
    writer.close()
    file = Hdf5File(path)
    order = [e.name if isinstance(e, EventEntry) else e.described["number"] for e in file.entries]
    assert order == ["resumed", 0, "reference", "measured", 1]
    assert file.entries[3] == EventEntry("measured", {"number": 0, "tare": True})
    np.testing.assert_array_equal(file.reference("second").pixels, pixels)
    with pytest.raises(InputError, match="no reference 'third'"):
        file.reference("third")


def test_plain_h5py_reads_columns_with_units_and_axes(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    writer = Hdf5Writer(path)
    writer.open(SESSION)
    writer.write_image(image(0, levels={"red": 1.0}))
    for fill in (0.25, 0.5):
        writer.write_reading(reading(height(fill), contact(), markers()))
    writer.close()
    with h5py.File(path) as file:
        tall = file["readings/height_mm"]
        assert (tall.shape, tall.dtype.name) == ((2, *SHAPE), "float32")
        assert (tall.attrs["unit"], tall.attrs["axes"]) == ("mm", "y x")
        assert tall.attrs["quantity"] == "HeightMap"
        assert tall[:, 0, 0].tolist() == [0.25, 0.5]
        assert file["readings/markers_px"].shape == (4, 2)
        assert file["reading_of/markers_px"][:].tolist() == [0, 0, 1, 1]
        assert file["images/timestamp_s"].attrs["unit"] == "s"
        assert file["images/levels/red"][:].tolist() == [1.0]
        assert file["images/pixels"].chunks == (1, *SHAPE, 3)
        assert (file["images/pixels"].compression, file["images/pixels"].fletcher32) == (
            "gzip",
            True,
        )


def arrays(file: Any, number: int) -> dict[str, Any]:
    """Return the arrays of a reading by the numbers of readings beside their rows."""
    begin, end = (0, *file["quantities_json_end"][:])[number : number + 2]
    found = {DESCRIPTION: file["quantities_json"][begin:end]}
    for column, rows in file["readings"].items():
        own = rows[:][file["reading_of"][column][:] == number]
        many = rows.attrs.get("rows") == "many"
        if len(own) or many:
            own = np.char.decode(own, "utf-8") if own.dtype.kind == "S" else own
            found.setdefault(column.partition(".")[0], own if many else np.asarray(own[0]))
    return found


def test_readings_come_back_as_quantities(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    slip = SlipState("incipient", 0.25, kind="rotation", rotation_deg=3.0)
    few = MarkerField(
        *(np.zeros(n, t) for n, t in ((0, "i4"),)),
        *(np.zeros((0, 2), "f4"),) * 2,
        np.zeros(0, bool),
        0.1,
    )
    taken = [
        reading(),
        reading(height(), slopes(), markers(), slip),
        reading(contact(), few, SlipState("x" * 200, 0.0)),  # type: ignore[arg-type]
        reading(height(0.75)),
    ]
    writer = Hdf5Writer(path)
    writer.open(SESSION)
    for one in taken:
        writer.write_reading(one)
    writer.close()
    with h5py.File(path) as file:
        assert len(file["readings_json_end"]) == len(file["quantities_json_end"]) == 4
        for number, one in enumerate(taken):
            back = quantities_in(arrays(file, number), *one.quantities)
            for kind, quantity in one.quantities.items():
                for name, array in quantity.arrays().items():
                    np.testing.assert_array_equal(back[kind].arrays()[name], array)


_FULL = """
import resource, sys
from contextlib import closing
from pathlib import Path
sys.path[:0] = sys.argv[3:]
from test_hdf5 import *
limit = int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
writer = Hdf5Writer(Path(sys.argv[1]))
try:
    writer.open(SESSION)
    with closing(writer):
        for number in range(600):
            writer.write_image(image(number))
            writer.write_event("measured", {"number": number})
            writer.write_reading(reading(height(), contact(), markers()))
except OSError as error:
    print(error.strerror)
"""


def test_an_existing_file_is_kept(tmp_path: Path) -> None:
    path = written(tmp_path / "a.h5", image(0))
    before = path.read_bytes()
    with pytest.raises(OSError, match="exists"):
        Hdf5Writer(path).open(SESSION)
    assert path.read_bytes() == before


def test_images_of_another_size_are_refused(tmp_path: Path) -> None:
    writer = Hdf5Writer(tmp_path / "a.h5")
    writer.open(SESSION)
    writer.write_image(image(0))
    with pytest.raises(InputError, match="record them in a new file"):
        writer.write_image(RecordedImage(Image(np.zeros((2, 2), np.uint8)), 1))
    writer.close()
    writer.close()


@pytest.mark.parametrize("content", [b"", b"\x89HDF\r\n\x1a\n", b"JPEG"])
def test_a_file_of_another_kind_is_refused_in_one_sentence(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"a\.h5 is not a readable HDF5 file"):
        Hdf5File(path)


def test_somebody_s_own_hdf5_file_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w", libver="latest"):
        pass
    with pytest.raises(InputError, match="no recording that tactile wrote"):
        Hdf5File(tmp_path / "a.h5")


def test_it_is_compressed_so_that_every_program_reads_it(tmp_path: Path) -> None:
    path = written(tmp_path / "a.h5", image(0))
    with h5py.File(path) as file:
        assert file["images/pixels"].compression == "gzip"


def test_a_file_with_blosc2_is_read(tmp_path: Path) -> None:
    hdf5plugin = pytest.importorskip("hdf5plugin", reason="it is absent; see 'make test-exports'")
    path = written(tmp_path / "a.h5", image(0))
    with h5py.File(path, "r+") as file:
        pixels = file["images/pixels"][:]
        del file["images/pixels"]
        file.create_dataset("images/pixels", data=pixels, **hdf5plugin.Blosc2())
    (back,) = images_of(Hdf5File(path))
    np.testing.assert_array_equal(back.pixels, pixels[0])


def test_a_truncated_file_is_refused_in_a_sentence(tmp_path: Path) -> None:
    path = written(tmp_path / "a.h5", *map(image, range(4)))
    whole = path.read_bytes()
    for share in np.linspace(0, 0.99, 12):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match=r"a\.h5"):
            Hdf5File(path)


def test_a_file_that_was_never_finished_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "a.h5", image(0))
    with h5py.File(path, "r+") as file:
        del file["finished"]
    with pytest.raises(InputError, match="was never finished; convert"):
        Hdf5File(path)


def flipped(path: Path, column: str, chunk: int) -> None:
    data = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        place = file[column].id.get_chunk_info(chunk)
    data[place.byte_offset + place.size // 2] ^= 4
    path.write_bytes(data)


def test_a_flipped_bit_in_a_column_is_noticed(tmp_path: Path) -> None:
    path = written(tmp_path / "a.h5", *map(image, range(600)))
    flipped(path, "images/timestamp_s", 0)
    with pytest.raises(InputError, match=r"a\.h5 is damaged"):
        Hdf5File(path)


def test_a_flipped_bit_in_an_image_is_noticed(tmp_path: Path) -> None:
    path = written(tmp_path / "a.h5", image(0), image(1))
    flipped(path, "images/pixels", 1)
    with Hdf5File(path) as file:
        first, second = (entry for entry in file.entries if isinstance(entry, ImageEntry))
        file.image(first)
        with pytest.raises(InputError, match=r"image 1 of a\.h5 is damaged"):
            file.image(second)


@pytest.mark.parametrize("limit_bytes", [0, 1, 2000, 10_000, 100_000, 400_000])
def test_a_disk_that_is_full_is_an_error_and_never_the_end_of_the_process(
    tmp_path: Path, limit_bytes: int
) -> None:
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            _FULL,
            tmp_path / "a.h5",
            str(limit_bytes),
            HERE,
            HERE.parents[2] / "tests",
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "File too large\n"), done.stderr
