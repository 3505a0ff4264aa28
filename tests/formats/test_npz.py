"""Arrays are read back unchanged; other content is rejected."""

from __future__ import annotations

import io
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npy, read_npz, write_npz


def test_arrays_are_read_back_with_their_dtypes(tmp_path: Path) -> None:
    arrays = {
        "height_mm": np.arange(6, dtype=np.float32).reshape(2, 3),
        "contact": np.array([[True, False]]),
        "mm_per_px": 0.1,
        "slip_state": np.asarray("stick"),
        "markers_px": np.zeros((0, 2), np.float32),
    }
    write_npz(tmp_path / "a.npz", arrays)
    for back in (read_npz(tmp_path / "a.npz"), dict(np.load(tmp_path / "a.npz"))):
        assert list(back) == list(arrays)
        for name, array in arrays.items():
            np.testing.assert_array_equal(back[name], array)
            assert back[name].dtype == np.asarray(array).dtype


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_npz(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_corrupt_files_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write_npz(path, {"a": np.arange(100), "b": np.ones(3)})
    data = path.read_bytes()
    for length in range(0, len(data), 41):
        path.write_bytes(data[:length])
        refusal(path)
    flipped = bytearray(data)
    flipped[300] ^= 255
    path.write_bytes(flipped)
    refusal(path)
    path.write_text("not an archive")
    assert "not an .npz" in refusal(path)
    refusal(tmp_path / "absent.npz")


def test_pickles_are_neither_read_nor_written(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, a=np.array([{"a": 1}], object))
    refusal(path)
    path.write_bytes(pickle.dumps({"a": 1}))
    refusal(path)
    path.unlink()
    with pytest.raises(ValueError, match="'a' contains Python objects"):
        write_npz(path, {"a": np.array([None])})
    assert not list(tmp_path.iterdir())


def zipped(path: Path, entry: bytes, name: str = "a.npy") -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, entry)
    return path


def with_shape(shape: tuple[int, ...], data: bytes) -> bytes:
    buffer = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(buffer, header)
    return buffer.getvalue() + data


@pytest.mark.parametrize("shape", [(10**9,), (10**15, 10**9), (2**64,), (3,)])
def test_an_array_larger_than_its_entry_is_rejected(tmp_path: Path, shape: tuple[int, ...]) -> None:
    assert "size" in refusal(zipped(tmp_path / "a.npz", with_shape(shape, bytes(16))))


def test_an_archive_that_unpacks_to_gigabytes_is_rejected(tmp_path: Path) -> None:
    path = zipped(tmp_path / "a.npz", with_shape((1 << 28,), bytes(1 << 20)))
    data = bytearray(path.read_bytes())
    at = data.rindex(b"PK\x01\x02") + 24  # the uncompressed size in the archive's directory
    data[at : at + 4] = (1 << 31).to_bytes(4, "little")
    path.write_bytes(data)
    assert "2.15 GB" in refusal(path)


def test_control_characters_in_an_array_name_are_escaped(tmp_path: Path) -> None:
    assert "\x1b" not in refusal(zipped(tmp_path / "a.npz", with_shape((9,), b""), "\x1b[31m.npy"))


@pytest.mark.parametrize(
    ("array", "kind"),
    [(np.zeros(3), "i"), (np.zeros(3, int), "f"), (np.array([np.nan]), "f"), (np.zeros(0), "f")],
)
def test_a_single_array_of_other_values_is_rejected(
    tmp_path: Path, array: np.ndarray, kind: str
) -> None:
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(InputError, match="other values"):
        read_npy(tmp_path / "a.npy", kind)


def test_a_single_pickled_object_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "a.npy").write_bytes(pickle.dumps({"a": 1}))
    with pytest.raises(InputError, match=r"no \.npy file"):
        read_npy(tmp_path / "a.npy", "f")
