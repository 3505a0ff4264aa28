"""A generated package installs, runs and passes its own test as it is."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from scaffold.pictures import photograph, sensor
from support.dist_info import write_dist_info

from tactile_core.errors import InputError
from tactile_core.profiles.loader import load_profile
from tactile_core.scaffold import NewPackage, new_package, new_profile
from tactile_core.scaffold.package import profile_path


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> NewPackage:
    """A package around the profile of a small sensor."""
    picture = photograph(sensor(), tmp_path_factory.mktemp("pictures") / "reference.png")
    return new_package(new_profile("ourtip", "hex_fingertip_unmarked", picture, scale="0.125"))


@pytest.fixture(scope="module")
def written(package: NewPackage, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its folder, installed as pip would install it."""
    folder = tmp_path_factory.mktemp("new") / "tactile-ourtip"
    package.write(folder)
    write_dist_info(folder, folder)
    return folder


def run(written: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run Python where the package is installed."""
    path = os.pathsep.join([str(written), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, *words],
        cwd=written,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


def test_its_own_tests_pass(written: Path) -> None:
    done = run(written, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests")
    assert done.returncode == 0, done.stdout + done.stderr


def test_its_profile_is_found_by_name_and_valid(written: Path) -> None:
    done = run(written, "-m", "tactile_core.cli", "validate", "ourtip")
    assert done.returncode == 0, done.stderr
    # whether the camera of the profile that it extends is connected is another question
    done = run(written, "-m", "tactile_core.cli", "doctor", "ourtip")
    assert "ok       plugin ourtip" in done.stdout


def test_its_code_passes_the_linters_of_the_core(written: Path) -> None:
    common = ("--isolated", "--line-length=100", "--no-cache", ".")
    for words in (("check", "--select=B,E,F,I,N,UP,W"), ("format", "--check")):
        done = run(written, "-m", "ruff", *words, *common)
        assert done.returncode == 0, done.stdout + done.stderr


def test_existing_files_are_replaced_only_by_force(package: NewPackage, tmp_path: Path) -> None:
    folder = tmp_path / "tactile-ourtip"
    folder.mkdir()
    (folder / "README.md").write_text("precious")
    (folder / "notes.md").write_text("mine")
    with pytest.raises(InputError, match="--force"):
        package.write(folder)
    assert (folder / "README.md").read_text() == "precious"
    package.write(folder, force=True)
    assert "ourtip" in (folder / "README.md").read_text()
    assert (folder / "notes.md").read_text() == "mine"
    assert profile_path(folder, "ourtip").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["tactile-ourtip"]


def test_force_follows_no_link_out_of_the_folder(package: NewPackage, tmp_path: Path) -> None:
    folder, elsewhere = tmp_path / "tactile-ourtip", tmp_path / "elsewhere"
    package.write(folder)
    shutil.rmtree(folder / "tests")
    elsewhere.mkdir()
    (elsewhere / "test_conformance.py").write_text("mine")
    (folder / "tests").symlink_to(elsewhere)
    (folder / "README.md").write_text("edited")
    with pytest.raises(InputError, match="leads out of"):
        package.write(folder, force=True)
    assert (elsewhere / "test_conformance.py").read_text() == "mine"
    assert (folder / "README.md").read_text() == "edited"


def test_force_replaces_no_folder_by_a_file(package: NewPackage, tmp_path: Path) -> None:
    folder = tmp_path / "tactile-ourtip"
    (folder / "README.md").mkdir(parents=True)
    (folder / "README.md" / "notes").write_text("mine")
    with pytest.raises(InputError, match=r"README\.md is a folder"):
        package.write(folder, force=True)
    assert [path.name for path in folder.iterdir()] == ["README.md"]


def test_a_file_that_the_profile_extends_is_copied_into_the_package(tmp_path: Path) -> None:
    picture = photograph(sensor(), tmp_path / "reference.png")
    mine = tmp_path / "mine"
    mine.mkdir()
    new_profile("base", "hex_fingertip_unmarked", picture).write(mine / "base.yaml")
    first = new_profile("first", mine / "base.yaml", picture, out=mine / "first.yaml")
    first.write(mine / "first.yaml")
    folder = tmp_path / "tactile-second"
    second = new_profile("second", mine / "first.yaml", picture, out=profile_path(folder, "second"))
    new_package(second).write(folder)
    shutil.rmtree(mine)
    profiles = profile_path(folder, "second").parent
    assert sorted(path.name for path in profiles.iterdir()) == [
        "base.yaml",
        "first.yaml",
        "second.yaml",
    ]
    without_step = profile_path(folder, "second").read_text().split("\nestimators:")[0]
    profile_path(folder, "second").write_text(without_step)
    assert load_profile(profile_path(folder, "second")).name == "second"


def test_files_of_different_folders_are_not_copied(tmp_path: Path) -> None:
    picture = photograph(sensor(), tmp_path / "reference.png")
    new_profile("base", "hex_fingertip_unmarked", picture).write(tmp_path / "base.yaml")
    below = tmp_path / "below" / "first.yaml"
    new_profile("first", tmp_path / "base.yaml", picture, out=below).write(below)
    second = new_profile("second", below, picture, out=tmp_path / "p.yaml")
    with pytest.raises(InputError, match="in another folder"):
        new_package(second)
    with pytest.raises(InputError, match="another name"):
        new_package(new_profile("base", tmp_path / "base.yaml", picture, out=tmp_path / "p.yaml"))
