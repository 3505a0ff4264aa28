"""The example of a camera with its lights works without changes of the core."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.dist_info import write_dist_info

pytestmark = pytest.mark.pages

PROJECT = Path(__file__).resolve().parents[2] / "examples" / "tactile-example-lights"


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """Return an environment in which the example is importable as if installed by pip."""
    write_dist_info(PROJECT, tmp_path)
    path = os.pathsep.join([str(PROJECT), str(tmp_path), *sys.path])
    return {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1"}


def run(environment: dict[str, str], *words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", *words],
        cwd=PROJECT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_its_own_tests_pass(environment: dict[str, str]) -> None:
    run(environment, "pytest", "-q", "-p", "no:cacheprovider", "tests")


def test_the_commands_list_and_check_its_light_driver(environment: dict[str, str]) -> None:
    listed = run(environment, "tactile_core.cli", "plugins")
    assert "light_driver" in listed
    assert "example_lights.box" in listed
    assert "ok       plugin example_lights" in run(environment, "tactile_core.cli", "doctor")
    assert "valid" in run(environment, "tactile_core.cli", "validate", "example_lights_bench")


def test_the_journal_has_one_line_per_measured_frame(
    environment: dict[str, str], tmp_path: Path
) -> None:
    profile = tmp_path / "journaled.yaml"
    profile.write_text(
        "extends: example_lights_bench\n"
        "sinks: {journal: {use: example_lights.journal, path: journal.jsonl}}\n"
    )
    words = ["--frames", "3", "--reference", "first", "--save", "journal", "--json"]
    lines = run(environment, "tactile_core.cli", "run", str(profile), *words).splitlines()
    assert len(lines) == 3
    first, *journal = (tmp_path / "journal.jsonl").read_text().splitlines()
    assert json.loads(first)["profile"] == "example_lights_bench"
    assert [json.loads(line) for line in journal] == [json.loads(line) for line in lines]
