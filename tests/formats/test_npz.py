"""Arrays come back; what is no arrays is refused."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npz, write_npz


def test_arrays_come_back_with_their_types(tmp_path: Path) -> None:
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


def test_corrupt_files_are_refused(tmp_path: Path) -> None:
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
    path.write_text("no archive")
    assert "no .npz" in refusal(path)
    refusal(tmp_path / "absent.npz")


def test_pickles_are_neither_read_nor_written(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, a=np.array([{"a": 1}], object))
    refusal(path)
    path.write_bytes(pickle.dumps({"a": 1}))
    refusal(path)
    path.unlink()
    with pytest.raises(ValueError, match="'a' holds Python objects"):
        write_npz(path, {"a": np.array([None])})
    assert not list(tmp_path.iterdir())
