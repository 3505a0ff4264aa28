"""Reading files with clear error messages, and writing them atomically."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.formats.files import (
    expand_home,
    plain_text,
    read_bytes,
    read_text,
    write_atomically,
    write_together,
)

# A limit of 1000 bytes per file simulates a full disk. It is set in a separate process with piped
# output, because it would apply to a log file of the tests too.
ON_A_FULL_DISK = """
import resource, sys
from pathlib import Path
from tactile_core.formats.files import write_atomically
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
try:
    write_atomically(Path(sys.argv[1]), bytes(1_000_000))
except OSError as error:
    print(error)
"""


def test_written_bytes_are_read_back(tmp_path: Path) -> None:
    write_atomically(tmp_path / "a.bin", b"one")
    write_atomically(tmp_path / "a.bin", memoryview(b"two"))
    assert read_bytes(tmp_path / "a.bin") == b"two"
    assert [path.name for path in tmp_path.iterdir()] == ["a.bin"]


def test_a_written_file_has_the_permissions_of_the_umask(tmp_path: Path) -> None:
    (tmp_path / "plain").write_bytes(b"")
    write_atomically(tmp_path / "ours", b"")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_full_disk_keeps_the_old_file_and_leaves_no_temporary_file(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    write_atomically(path, b"before")
    command = [sys.executable, "-c", ON_A_FULL_DISK, str(path)]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "large" in output
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]


def test_several_files_are_written_together_or_not_at_all(tmp_path: Path) -> None:
    a, b = tmp_path / "a", tmp_path / "gone" / "b"
    a.write_bytes(b"before")
    with pytest.raises(FileNotFoundError):
        write_together({a: b"after", b: b"after"})
    assert a.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [a]
    b.parent.mkdir()
    write_together({a: b"after", b: b"after"})
    assert a.read_bytes() == b.read_bytes() == b"after"


def test_a_file_with_the_longest_possible_name_is_written(tmp_path: Path) -> None:
    path = tmp_path / ("x" * 255)
    write_atomically(path, b"one")
    assert list(tmp_path.iterdir()) == [path]


def test_lone_surrogates_in_text_are_escaped() -> None:
    assert plain_text("ball \udcff ² \ud800") == r"ball \udcff ² \ud800"


def test_a_missing_file_and_a_folder_have_different_messages(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_bytes(tmp_path / "absent")
    with pytest.raises(InputError, match="is a folder"):
        read_bytes(tmp_path)


def test_a_file_above_the_size_limit_is_rejected_before_reading(tmp_path: Path) -> None:
    with (tmp_path / "a.bin").open("wb") as file:
        file.truncate(1 << 40)  # a sparse file uses no disk space
    with pytest.raises(InputError, match="too large"):
        read_bytes(tmp_path / "a.bin")


def test_an_endless_system_file_is_not_read_to_its_end() -> None:
    assert read_bytes(Path("/proc/self/maps")) == b""


def test_text_in_another_encoding_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="UTF-8"):
        read_text(tmp_path / "a.txt")


def test_the_home_folder_of_an_unknown_user_is_rejected() -> None:
    assert expand_home("~") == Path.home()
    with pytest.raises(InputError, match="home folder"):
        expand_home("~no_such_user/x.yaml")
