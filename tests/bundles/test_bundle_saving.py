"""Saving a bundle: in one atomic step, without touching files that are not part of it."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.bundles_on_disk import edit, held
from support.virtual_lab import VirtualLab

from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import InputError
from tactile_core.formats import folders


@pytest.fixture
def copy(lab: VirtualLab, tmp_path: Path) -> Path:
    return Path(shutil.copytree(lab.bundle, tmp_path / "bundle"))


def test_a_new_bundle_replaces_the_old_one_whole(lab: VirtualLab, copy: Path) -> None:
    Bundle.load(lab.bundle).save(copy)
    assert set(held(copy.parent)) == {
        "bundle/manifest.json",
        "bundle/errors/errors.npz",
        "bundle/light/model.npz",
        "bundle/reference.npz",
    }


@pytest.mark.parametrize("foreign", ["notes.txt", "src/main.py", ".hidden", "manifest.json.old"])
def test_a_bundle_with_a_foreign_file_is_left_alone(
    lab: VirtualLab, copy: Path, foreign: str
) -> None:
    (copy / foreign).parent.mkdir(exist_ok=True)
    (copy / foreign).write_text("mine")
    before = held(copy.parent)
    with pytest.raises(InputError, match=rf"holds {foreign}, .* move it away or name another"):
        Bundle.load(lab.bundle).save(copy)
    assert held(copy.parent) == before


def test_a_foreign_empty_folder_is_left_alone(lab: VirtualLab, copy: Path) -> None:
    (copy / "later").mkdir()
    with pytest.raises(InputError, match="holds later"):
        Bundle.load(lab.bundle).save(copy)
    assert (copy / "later").is_dir()


def test_a_folder_in_the_place_of_a_bundle_s_file_is_left_alone(
    lab: VirtualLab, copy: Path
) -> None:
    (copy / "reference.npz").unlink()
    (copy / "reference.npz").mkdir()
    with pytest.raises(InputError, match=r"holds reference\.npz"):
        Bundle.load(lab.bundle).save(copy)
    assert (copy / "reference.npz").is_dir()
    assert list(copy.parent.iterdir()) == [copy]


@pytest.mark.parametrize("manifest", ["{}", '{"manifest_version": 3, "name": "web app"}', "\0"])
def test_a_project_with_a_manifest_of_its_own_is_left_alone(
    lab: VirtualLab, tmp_path: Path, manifest: str
) -> None:
    (tmp_path / "app" / "src").mkdir(parents=True)
    (tmp_path / "app" / "manifest.json").write_text(manifest)
    (tmp_path / "app" / "src" / "main.py").write_text("years of work")
    before = held(tmp_path)
    with pytest.raises(InputError, match="not a calibration bundle"):
        Bundle.load(lab.bundle).save(tmp_path / "app")
    assert held(tmp_path) == before


def test_a_manifest_that_names_files_elsewhere_deletes_none_of_them(
    lab: VirtualLab, copy: Path
) -> None:
    precious = copy.parent / "precious"
    precious.write_text("mine")
    ours = ("errors/errors.npz", "light/model.npz", "reference.npz")
    edit(copy, files=dict.fromkeys(("../precious", str(precious), *ours), ""))
    with pytest.raises(InputError, match=r"holds report\.html"):
        Bundle.load(lab.bundle).save(copy)
    (copy / "report.html").unlink()
    Bundle.load(lab.bundle).save(copy)
    assert precious.read_text() == "mine"


def test_a_folder_that_is_no_bundle_is_left_alone(lab: VirtualLab, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="not a calibration bundle"):
        Bundle.load(lab.bundle).save(tmp_path)
    assert (tmp_path / "thesis.tex").exists()


def test_when_writing_fails_the_previous_bundle_survives(lab: VirtualLab, copy: Path) -> None:
    def full_disk(folder: Path) -> None:
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        Bundle.load(lab.bundle).save(copy, report=full_disk)
    assert Bundle.load(copy).manifest == Bundle.load(lab.bundle).manifest
    assert [p.name for p in copy.parent.iterdir()] == ["bundle"]


def test_a_file_that_is_added_while_a_bundle_is_replaced_is_kept(
    lab: VirtualLab, copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    exchange = folders._exchange

    def concurrent_save(one: Path, other: Path) -> None:
        monkeypatch.undo()
        (other / "notes.txt").write_text("mine")
        exchange(one, other)

    bundle = Bundle.load(lab.bundle)
    monkeypatch.setattr(folders, "_exchange", concurrent_save)
    with pytest.raises(InputError, match=r"holds notes\.txt"):
        bundle.save(copy)
    assert (copy / "notes.txt").read_text() == "mine"
    assert Bundle.load(copy).manifest == Bundle.load(lab.bundle).manifest
    assert [p.name for p in copy.parent.iterdir()] == ["bundle"]


WRITES = """
import sys
from pathlib import Path
from tactile_core.bundles.bundle import Bundle
bundle = Bundle.load(Path(sys.argv[1]))
for _ in range(int(sys.argv[3])):
    bundle.save(Path(sys.argv[2]))
"""


def test_readers_always_find_a_bundle_while_two_processes_write(
    lab: VirtualLab, tmp_path: Path
) -> None:
    place = tmp_path / "b"
    Bundle.load(lab.bundle).save(place)
    command = [sys.executable, "-c", WRITES, str(lab.bundle), str(place), "40"]
    writers = [subprocess.Popen(command, stderr=subprocess.PIPE) for _ in range(2)]
    loads = 0
    while any(writer.poll() is None for writer in writers):
        assert (place / "manifest.json").is_file()
        assert Bundle.load(place).manifest.serial == "0007"
        loads += 1
    assert [writer.communicate()[1] for writer in writers] == [b"", b""]
    assert [writer.returncode for writer in writers] == [0, 0]
    assert loads > 0
    assert [p.name for p in tmp_path.iterdir()] == ["b"]
    Bundle.load(place)


KILLED = """
import os, signal, sys
from pathlib import Path
from tactile_core.bundles import bundle
from tactile_core.formats import folders
loaded = bundle.Bundle.load(Path(sys.argv[1]))
def die(*_):
    os.kill(os.getpid(), signal.SIGKILL)
if sys.argv[3] == "before":
    loaded.save(Path(sys.argv[2]), report=die)
folders._delete = die
loaded.save(Path(sys.argv[2]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
@pytest.mark.parametrize("moment", ["before", "after"])
def test_the_next_writer_removes_the_leftovers_of_a_killed_one_and_nothing_else(
    lab: VirtualLab, copy: Path, moment: str
) -> None:
    command = [sys.executable, "-c", KILLED, str(lab.bundle), str(copy), moment]
    subprocess.run(command, check=False)
    (left,) = (path for path in copy.parent.iterdir() if path != copy)
    assert left.name.startswith(".bundle.tactile-")
    Bundle.load(copy)
    others = [copy.parent / f".bundle-{name}" for name in ("x1y2z3", "old-abc", "tactile-1")]
    for other in others:
        other.mkdir()
        (other / "mine").write_text("mine")
    Bundle.load(lab.bundle).save(copy)
    assert sorted(copy.parent.iterdir()) == sorted([copy, *others])
