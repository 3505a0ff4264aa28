"""Leftovers of killed processes are removed; files of other owners are not."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tactile_core.formats.files import find_replaced, remove_leftovers, temporary_path

LEAVES = """
import sys
from pathlib import Path
from tactile_core.formats.files import temporary_path
folder = Path(sys.argv[1])
temporary_path(folder / "a.npz").write_text("half")
temporary_path(folder / ("long" * 60)).write_text("half")
temporary_path(folder / "b").mkdir()
temporary_path(folder / "b", "old").mkdir()
"""


@pytest.fixture
def left(tmp_path: Path) -> Path:
    """A folder with the unfinished files of a process that has ended."""
    subprocess.run([sys.executable, "-c", LEAVES, str(tmp_path)], check=True)
    return tmp_path


def test_only_new_leftovers_are_removed(left: Path) -> None:
    assert len(list(left.iterdir())) == 4
    remove_leftovers(left)
    (old,) = left.iterdir()
    assert find_replaced(left / "b") == [old]
    assert find_replaced(left / "c") == []


def test_names_of_running_or_remote_processes_are_kept(left: Path) -> None:
    mine = temporary_path(left / "mine")
    name = next(path.name for path in left.iterdir() if path.name.startswith(".a.npz"))
    here = name.partition(".tactile-")[2][:8]
    others = [
        mine,
        left / name.replace(here, "0" * 8),
        left / name.replace(".new", ""),
        left / f"{name}.txt",
        left / name.removeprefix("."),
    ]
    for path in others:
        path.write_text("mine")
    remove_leftovers(left)
    assert set(others) <= set(left.iterdir())
    assert not (left / name).exists()


def test_a_link_is_removed_but_not_its_target(left: Path, tmp_path: Path) -> None:
    folder = next(
        path for path in left.iterdir() if path.name.startswith(".b.") and "new" in path.name
    )
    folder.rmdir()
    (tmp_path / "precious").mkdir()
    (tmp_path / "precious" / "mine").write_text("mine")
    folder.symlink_to(tmp_path / "precious")
    remove_leftovers(left)
    assert not folder.is_symlink()
    assert (tmp_path / "precious" / "mine").exists()
