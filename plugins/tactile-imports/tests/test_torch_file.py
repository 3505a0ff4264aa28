"""Tensors of a file of PyTorch are read without PyTorch, and nothing that it names is run."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.torch_files import write_torch_file

from tactile_core import InputError
from tactile_imports.torch_file import read_torch_file


def said_of(path: Path) -> str:
    with pytest.raises(InputError) as refusal:
        read_torch_file(path)
    said = str(refusal.value)
    assert str(path) in said
    assert "\n" not in said
    return said


@pytest.mark.parametrize("dtype", ["f4", "f8", "i8"])
def test_tensors_and_dictionaries_are_read_as_they_were_saved(tmp_path: Path, dtype: str) -> None:
    saved = {
        "epoch": 7,
        "state_dict": {
            "fc1.weight": np.arange(6, dtype=dtype).reshape(2, 3),
            "fc1.bias": np.array([1, 2], dtype),
        },
    }
    read = read_torch_file(write_torch_file(tmp_path / "a.pt", saved))
    assert read["epoch"] == 7
    for name, array in saved["state_dict"].items():  # type: ignore[attr-defined]
        assert read["state_dict"][name].dtype == array.dtype
        np.testing.assert_array_equal(read["state_dict"][name], array)


class Touch:
    """Writes a file when it is unpickled freely."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return exec, (f"open({str(self.path)!r}, 'w')",)


def test_another_name_is_refused_and_not_run(tmp_path: Path) -> None:
    evidence = tmp_path / "evidence"
    pickled = pickle.dumps(Touch(evidence), protocol=2)
    said = said_of(write_torch_file(tmp_path / "a.pt", {}, pickled=pickled))
    assert "names __builtin__.exec" in said or "names builtins.exec" in said
    assert "torch.save(network.state_dict(), FILE)" in said
    assert not evidence.exists()


@pytest.mark.parametrize(
    "name", [b"os\nsystem", b"torch\nload", b"torch._utils\n_rebuild_parameter", b"numpy\ndtype"]
)
def test_each_name_outside_the_list_is_refused(tmp_path: Path, name: bytes) -> None:
    file = write_torch_file(tmp_path / "a.pt", {}, pickled=b"\x80\x02c" + name + b"\n.")
    assert f"names {name.decode().replace(chr(10), '.')}" in said_of(file)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.pth"
    path.write_bytes(b"\x80\x02}q\x00.")
    assert "is no zip archive of torch.save" in said_of(path)
    path.write_bytes(b"PK\x03\x04 and then nothing")
    assert "holds no tensors that can be read" in said_of(path)


@pytest.mark.parametrize("drop", ["data.pkl", "data/0"])
def test_a_file_with_a_missing_part_is_refused(tmp_path: Path, drop: str) -> None:
    file = write_torch_file(tmp_path / "a.pt", {"a": np.zeros(3, np.float32)}, drop=drop)
    assert "holds no tensors that can be read" in said_of(file)


def tensor(
    size: bytes, stride: bytes, *, count: bytes = b"K\x04", offset: bytes = b"K\x00"
) -> bytes:
    """Return a pickle of one tensor, of a storage of four numbers."""
    storage = (
        b"(X\x07\x00\x00\x00storagectorch\nFloatStorage\nX\x01\x00\x00\x000X\x03\x00\x00\x00cpu"
    )
    return b"\x80\x02ctorch._utils\n_rebuild_tensor_v2\n(" + (
        storage + count + b"tQ" + offset + b"(" + size + b"t(" + stride + b"t\x89tR."
    )


@pytest.mark.parametrize(
    "pickled",
    [
        tensor(b"K\x05", b"K\x01"),
        tensor(b"K\x04", b"K\x02"),
        tensor(b"K\x04", b"K\x01", offset=b"K\x01"),
        tensor(b"K\x04", b"K\x01", offset=b"J\xff\xff\xff\xff"),
        tensor(b"J\x00\x00\x00\x7f", b"K\x00"),
        tensor(b"K\x04", b"K\x01", count=b"K\x05"),
        b"\x80\x02r\xff\xff\xff\x7f.",
    ],
    ids=["long", "wide", "late", "early", "repeated", "short-storage", "memo"],
)
def test_a_tensor_never_reaches_beyond_its_storage(tmp_path: Path, pickled: bytes) -> None:
    four = {"a": np.arange(4, dtype=np.float32)}
    whole = write_torch_file(tmp_path / "whole.pt", four, pickled=tensor(b"K\x04", b"K\x01"))
    np.testing.assert_array_equal(read_torch_file(whole), four["a"])
    file = write_torch_file(tmp_path / "a.pt", four, pickled=pickled)
    assert "holds no tensors that can be read" in said_of(file)
