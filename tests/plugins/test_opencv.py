"""OpenCV's packages share one folder: two of them, or one that was removed, are recognised."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

# what is left of the folder: nothing, or a module whose library is missing
BROKEN = {
    "gone": "raise ModuleNotFoundError(\"No module named 'cv2'\", name='cv2')",
    "no library": "raise ImportError('libGL.so.1: cannot open shared object file')",
}


def site(folder: Path, cv2: str | None, *packages: str) -> Path:
    for name in packages:
        info = folder / f"{name.replace('-', '_')}-4.10.0.84.dist-info"
        info.mkdir(parents=True)
        metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: 4.10.0.84\n"
        (info / "METADATA").write_text(metadata, encoding="utf-8")
    if cv2 is not None:
        (folder / "cv2").mkdir(parents=True)
        (folder / "cv2" / "__init__.py").write_text(cv2, encoding="utf-8")
    return folder


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    paths = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": paths}
    return subprocess.run(
        [sys.executable, *words], env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("left", BROKEN)
def test_a_command_names_the_pip_command_where_opencv_is_broken(tmp_path: Path, left: str) -> None:
    folder = site(tmp_path, BROKEN[left])
    done = run(folder, "-m", "tactile_core.cli", "doctor")
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith("tactile: OpenCV cannot be imported; ")
    assert "--no-deps opencv-contrib-python-headless'" in line


def test_a_program_that_imports_the_package_reads_the_same(tmp_path: Path) -> None:
    done = run(site(tmp_path, BROKEN["gone"]), "-c", "from tactile_core import Pipeline")
    assert "ImportError: OpenCV cannot be imported; " in done.stderr.splitlines()[-1]


def test_an_empty_folder_is_a_problem_and_ends_commands_with_the_remedy(tmp_path: Path) -> None:
    folder = site(tmp_path, "")
    done = run(folder, "-m", "tactile_core.cli", "doctor")
    assert (done.returncode, "OpenCV cannot be imported; " in done.stdout) == (2, True)
    done = run(folder, "-m", "tactile_core.cli", "run", "hex_fingertip", "--sim", "--frames", "1")
    assert done.returncode
    assert "; OpenCV cannot be imported; " in done.stderr.splitlines()[-1]


def test_two_packages_are_a_problem_before_one_is_removed(tmp_path: Path) -> None:
    done = run(site(tmp_path, None, "opencv-python"), "-m", "tactile_core.cli", "doctor")
    assert done.returncode == 2
    assert "opencv-contrib-python-headless and opencv-python are both installed" in done.stdout
    assert "pip uninstall -y opencv-contrib-python-headless opencv-python'" in done.stdout
