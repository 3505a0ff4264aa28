"""What a killed process left is removed; what may be anybody else's is not."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tactile_core.formats.unfinished import beside, remove_leftovers, replaced

LEAVES = """
import sys
from pathlib import Path
from tactile_core.formats.unfinished import beside
folder = Path(sys.argv[1])
beside(folder / "a.npz").write_text("half")
beside(folder / ("long" * 60)).write_text("half")
beside(folder / "b").mkdir()
beside(folder / "b", "old").mkdir()
"""


@pytest.fixture
def left(tmp_path: Path) -> Path:
    """A folder with what a process that has ended did not finish."""
    subprocess.run([sys.executable, "-c", LEAVES, str(tmp_path)], check=True)
    return tmp_path


def test_only_what_has_never_been_at_its_place_is_removed(left: Path) -> None:
    assert len(list(left.iterdir())) == 4
    remove_leftovers(left)
    (old,) = left.iterdir()
    assert replaced(left / "b") == [old]
    assert replaced(left / "c") == []


def test_what_runs_elsewhere_or_still_is_left_alone(left: Path) -> None:
    mine = beside(left / "mine")
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


def test_a_link_is_removed_and_not_what_it_leads_to(left: Path, tmp_path: Path) -> None:
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
