"""The example of an arm: two results, an external input, its own quantities and its own sink."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command_line import tactile
from support.dist_info import write_dist_info
from support.virtual_lab import VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.formats.images import read_image
from tactile_core.formats.npz import arrays_of, read_npz, read_quantities, write_npz
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.quantities import HeightMap

pytestmark = pytest.mark.pages

Run = Callable[[Path | None, Path], list[dict[str, Any]]]

PROJECT = Path(__file__).resolve().parents[2] / "examples" / "tactile-example-arm"
MODULE = "tactile_example_arm"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Path]]:
    """Make the example importable as if pip had installed it; return its folders."""
    site = tmp_path / "site"
    site.mkdir()
    write_dist_info(PROJECT, site)
    folders = [PROJECT, site]
    for folder in folders:
        monkeypatch.syspath_prepend(folder)
    yield folders
    for name in [name for name in sys.modules if name.partition(".")[0] == MODULE]:
        del sys.modules[name]


PROFILE = """\
extends: {lab}
estimators:
  workpiece: {{use: example_arm.workpiece}}
sinks:
  log: {{use: example_arm.log, path: touches.log, decimals: 1}}
"""


@pytest.fixture
def run(installed: list[Path], lab: VirtualLab, tmp_path: Path) -> Run:
    """Return a function that measures the lab's presses with the plugin's step and sink."""
    profile = tmp_path / "arm.yaml"
    profile.write_text(PROFILE.format(lab=lab.profile_path))

    def measured(external: Path | None, out: Path) -> list[dict[str, Any]]:
        done = tactile(
            *("run", profile, "--bundle", lab.bundle, "--input", lab.presses, "--json"),
            *("--out", out, "--save", "npz,png,log"),
            *(() if external is None else ("--external", external)),
        )
        assert done.returncode == 0, done.stderr
        return [json.loads(line) for line in done.stdout.splitlines()]

    return measured


@pytest.fixture
def poses(installed: list[Path], lab: VirtualLab, tmp_path: Path) -> Path:
    """Write the arm's pose for each press: one millimetre higher each time."""
    from tactile_example_arm.workpiece import ArmPose

    folder = tmp_path / "poses"
    folder.mkdir()
    for number, press in enumerate(sorted(lab.presses.iterdir())):
        pose = ArmPose(np.float32([0, 0, number]), np.diag(np.float32([1, -1, -1])))
        write_npz(folder / f"{press.stem}.npz", arrays_of([pose], mm_per_px=0.1))
    return folder


def test_the_step_uses_the_pose_of_each_frame(run: Run, poses: Path, tmp_path: Path) -> None:
    from tactile_example_arm.workpiece import ArmPose, Profile3D, TouchPoint

    lines = run(poses, tmp_path / "out")
    assert all(line["touches"] for line in lines)
    for number, line in enumerate(lines):
        path = tmp_path / "out" / f"{line['source']}.npz"
        found = read_quantities(path, HeightMap, ArmPose, Profile3D, TouchPoint)
        height, pose = found[HeightMap], found[ArmPose]
        profile, touch = found[Profile3D], found[TouchPoint]
        assert isinstance(pose, ArmPose)
        assert isinstance(height, HeightMap)
        assert isinstance(profile, Profile3D)
        assert isinstance(touch, TouchPoint)
        assert pose.origin_mm[2] == number
        np.testing.assert_allclose(profile.z_mm, height.mm + number, atol=1e-5)
        assert touch.world_mm is not None
        assert 0 < touch.world_mm[2] - number < 2


def test_its_quantity_is_drawn_next_to_the_height(run: Run, poses: Path, tmp_path: Path) -> None:
    wide = run(poses, tmp_path / "with")[0]["source"]
    run(None, tmp_path / "without")
    with_it, alone = (read_image(tmp_path / f / f"{wide}.png") for f in ("with", "without"))
    assert with_it.shape[1] > 1.9 * alone.shape[1]


def test_its_sink_writes_one_line_per_touch(run: Run, poses: Path, tmp_path: Path) -> None:
    lines = run(poses, tmp_path / "out")
    log = (tmp_path / "touches.log").read_text().splitlines()
    assert log[0] == "# virtual_lab without serial"
    assert [line.split()[0] for line in log[1:]] == [line["source"] for line in lines]


def test_a_run_with_the_inputs_saved_by_another_gives_the_same_results(
    run: Run, poses: Path, tmp_path: Path
) -> None:
    first = run(poses, tmp_path / "first")
    second = run(tmp_path / "first", tmp_path / "second")
    assert len(first) == len(second)
    for line in first:
        one, two = (read_npz(tmp_path / f / f"{line['source']}.npz") for f in ("first", "second"))
        assert one.keys() == two.keys()
        for name, array in one.items():
            np.testing.assert_array_equal(array, two[name])


def test_without_a_pose_the_step_is_left_out_with_a_warning(run: Run, tmp_path: Path) -> None:
    line = run(None, tmp_path / "out")[0]
    assert "touches" not in line
    assert any("step 'workpiece' needs ArmPose" in words for words in line["warnings"])
    assert "height_mm" in read_npz(tmp_path / "out" / f"{line['source']}.npz")


def test_a_program_passes_the_pose_and_reads_both_results(
    installed: list[Path], lab: VirtualLab, tmp_path: Path
) -> None:
    from tactile_example_arm.workpiece import ArmPose, Profile3D, TouchPoint

    profile = tmp_path / "arm.yaml"
    profile.write_text(PROFILE.format(lab=lab.profile_path))
    pipeline = Pipeline(profile, lab.bundle)
    frame = pipeline.frame(lab.image(BallPress((80, 60), 4.0, 0.8)))
    pose = ArmPose(np.zeros(3, np.float32), np.eye(3, dtype=np.float32))
    reading = pipeline.process(frame, pose)
    assert reading["workpiece"] is reading[Profile3D]
    assert reading[TouchPoint].touches
    assert reading.inputs[ArmPose] is pose


def test_its_own_tests_and_the_conformance_kit_pass(installed: list[Path]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"],
        cwd=PROJECT,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*map(str, installed), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
