"""What a full disk refuses can still be read back, until the file is closed."""

from __future__ import annotations

import os
import resource
from pathlib import Path

import pytest

from tactile_hdf5.column_file import PatientDisk


def test_what_is_refused_is_read_back_and_reported(tmp_path: Path) -> None:
    was = resource.getrlimit(resource.RLIMIT_FSIZE)
    disk = PatientDisk(tmp_path / "a")
    resource.setrlimit(resource.RLIMIT_FSIZE, (6, was[1]))
    try:
        disk.write(b"1234")
        disk.check()
        disk.write(b"5678")
        disk.seek(2)
        disk.write(b"!!")
        disk.truncate(20)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, was)
    found = bytearray(10)
    disk.seek(0)
    assert disk.readinto(memoryview(found)) == 10
    assert found == b"12!!5678\0\0"
    assert disk.seek(0, os.SEEK_END) == 20
    with pytest.raises(OSError, match="too large"):
        disk.check()
    with pytest.raises(OSError, match="too large"):
        disk.close()
    disk.close()


def test_an_existing_file_is_kept(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"mine")
    with pytest.raises(FileExistsError):
        PatientDisk(tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == b"mine"
