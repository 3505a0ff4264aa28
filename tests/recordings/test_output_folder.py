"""Only files that a command wrote are overwritten."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.recordings.inputs import Inputs
from tactile_core.recordings.output_folder import WRITTEN, OutputFolder, safe_stem


def write(folder: OutputFolder, text: str, name: str = "a.txt") -> Path:
    return folder.write(name, lambda path: path.write_text(text) and None, of=text)


def test_a_later_run_replaces_files_of_an_earlier_one(tmp_path: Path) -> None:
    for text in ("one", "two", "three"):
        assert write(OutputFolder(tmp_path / "out"), text).read_text() == text
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [WRITTEN, "a.txt"]


def test_files_of_a_copied_folder_are_replaced_too(tmp_path: Path) -> None:
    write(OutputFolder(tmp_path / "out"), "one")
    shutil.copytree(tmp_path / "out", tmp_path / "copy")
    assert write(OutputFolder(tmp_path / "copy"), "two").read_text() == "two"


def test_files_that_no_command_wrote_are_kept(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path)
    write(folder, "ours")
    (tmp_path / "b.txt").write_text("mine")
    (tmp_path / "c.txt").mkdir()
    (tmp_path / "d.txt").symlink_to(tmp_path / "nowhere")
    (tmp_path / "a.txt").write_text("mine, under our name")
    for name in ("a.txt", "b.txt", "c.txt", "d.txt"):
        for again in (folder, OutputFolder(tmp_path)):
            with pytest.raises(InputError, match=rf"{name} already exists.* move it away or name"):
                again.check([name])
            with pytest.raises(InputError, match=rf"{name} already exists.* move it away or name"):
                write(again, "new", name)
    assert (tmp_path / "a.txt").read_text() == "mine, under our name"
    assert (tmp_path / "b.txt").read_text() == "mine"
    assert not (tmp_path / "nowhere").exists()


def test_a_file_that_the_user_recreated_is_kept(tmp_path: Path) -> None:
    path = write(OutputFolder(tmp_path), "one")
    path.unlink()
    path.write_text("two")
    with pytest.raises(InputError, match="already exists"):
        write(OutputFolder(tmp_path), "new")


def test_writing_a_file_twice_in_one_run_names_both_observations(tmp_path: Path) -> None:
    write(OutputFolder(tmp_path), "former")
    folder = OutputFolder(tmp_path)
    write(folder, "first")
    with pytest.raises(InputError, match=r"was written for first in this run .* again for second"):
        write(folder, "second")
    assert (tmp_path / "a.txt").read_text() == "first"


def test_a_file_that_appears_during_writing_is_kept(tmp_path: Path) -> None:
    def slow(path: Path) -> None:
        (tmp_path / "a.txt").write_text("mine")
        path.write_text("ours")

    with pytest.raises(InputError, match="already exists"):
        OutputFolder(tmp_path).write("a.txt", slow)
    assert (tmp_path / "a.txt").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_failed_write_keeps_the_old_file(tmp_path: Path) -> None:
    def fails(path: Path) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    write(OutputFolder(tmp_path), "one")
    for name in ("a.txt", "b.txt"):
        with pytest.raises(OSError, match="No space"):
            OutputFolder(tmp_path).write(name, fails)
    assert (tmp_path / "a.txt").read_text() == "one"
    assert sorted(path.name for path in tmp_path.iterdir()) == [WRITTEN, "a.txt"]


@pytest.mark.parametrize(
    "tail", [b'\n{"file": "b.t', b"\n[[[", b"\n" + b"[" * 99_999, b"\n\xff", b"\n"]
)
def test_a_truncated_list_keeps_its_complete_entries(tmp_path: Path, tail: bytes) -> None:
    write(OutputFolder(tmp_path), "one")
    with (tmp_path / WRITTEN).open("ab") as file:
        file.write(tail)
    write(OutputFolder(tmp_path), "two")
    write(OutputFolder(tmp_path), "three")
    assert (tmp_path / "a.txt").read_text() == "three"


def test_a_foreign_list_of_outputs_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine")
    (tmp_path / WRITTEN).symlink_to(tmp_path / "mine")
    with pytest.raises(InputError, match="is not a list that tactile wrote"):
        OutputFolder(tmp_path)
    (tmp_path / WRITTEN).unlink()
    (tmp_path / WRITTEN).write_text("mine")
    with pytest.raises(InputError, match="is not a list that tactile wrote"):
        OutputFolder(tmp_path)
    assert (tmp_path / WRITTEN).read_text() == (tmp_path / "mine").read_text() == "mine"


def test_an_output_that_is_also_an_input_is_not_replaced(tmp_path: Path) -> None:
    path = write(OutputFolder(tmp_path / "out"), "one")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "linked").hardlink_to(path)
    folder = OutputFolder(tmp_path / "out", Inputs.from_paths({"--input": tmp_path / "in"}))
    with pytest.raises(InputError, match="is one of --input"):
        write(folder, "two")
    assert path.read_text() == "one"


KILLED = """
import os, signal, sys
from tactile_core.recordings.output_folder import OutputFolder
def die(path):
    path.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
OutputFolder(sys.argv[1]).write("a.txt", die)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no SIGKILL")
def test_leftovers_of_a_killed_run_are_removed_by_the_next(tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert len(list(tmp_path.iterdir())) == 1
    write(OutputFolder(tmp_path), "one")
    assert sorted(path.name for path in tmp_path.iterdir()) == [WRITTEN, "a.txt"]


def test_the_folder_is_created_with_the_first_file(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path / "a" / "b")
    folder.check(["a.txt"])
    assert list(tmp_path.iterdir()) == []
    write(folder, "one")
    (tmp_path / "file").write_text("mine")
    for path in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="file is a file; name a folder"):
            OutputFolder(path).check(["a.txt"])
        with pytest.raises(InputError, match="is a file; name a folder"):
            write(OutputFolder(path), "one")


def test_changed_names_stay_distinct() -> None:
    sources = ["a/b", "a_b", "a\\b", "x" * 300, "x" * 301, "..", "."]
    assert len({safe_stem(source) for source in sources}) == len(sources)
    assert safe_stem("press.v1") == "press.v1"


def test_observations_whose_results_would_share_a_name_are_rejected(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path / "out")
    pictures = [".png", "_normals.png"]
    with pytest.raises(InputError, match=r"results of a and of a_normals would both be a_normals"):
        folder.check_for(["a", "a_normals"], pictures)
    with pytest.raises(InputError, match=r"results of twice and of twice would both be twice.npz"):
        folder.check_for(["twice", "twice"], [".npz"])
    folder.check_for(["a", "a_normals"], [".npz", ".tmd"])
    assert not folder.path.exists()


def test_a_foreign_file_is_rejected_before_measuring(
    tmp_path: Path,
) -> None:
    (tmp_path / "press.tmd").write_bytes(b"my own")
    with pytest.raises(InputError, match=r"press\.tmd already exists"):
        OutputFolder(tmp_path).check_for(["press"], [".tmd"])


@pytest.mark.parametrize("target", ["loop", "nowhere"])
def test_a_link_that_leads_nowhere_is_no_folder(tmp_path: Path, target: str) -> None:
    (tmp_path / "loop").symlink_to(target)
    with pytest.raises(InputError, match="loop is a link that leads nowhere; name a folder"):
        OutputFolder(tmp_path / "loop" / "below")
