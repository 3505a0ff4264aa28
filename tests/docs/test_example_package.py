"""The example of an estimator and a quantity works without changes of the core."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.dist_info import write_dist_info

from tactile_core.errors import PluginError
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.pipeline.chain import Chain
from tactile_core.plugins.registry import list_plugins, resolve
from tactile_core.quantities import HeightMap

pytestmark = pytest.mark.pages

PROJECT = Path(__file__).resolve().parents[2] / "examples" / "tactile-example-estimator"
MODULE = "tactile_example_estimator"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Path]]:
    """Make the example importable as if pip had installed it; return its folders."""
    write_dist_info(PROJECT, tmp_path)
    folders = [PROJECT, tmp_path]
    for folder in folders:
        monkeypatch.syspath_prepend(folder)
    yield folders
    for name in [name for name in sys.modules if name.partition(".")[0] == MODULE]:
        del sys.modules[name]


def test_a_missing_package_gives_the_pip_command() -> None:
    with pytest.raises(PluginError, match="pip install tactile-example-estimator"):
        resolve("estimator", "example_estimator.volume")


@pytest.mark.usefixtures("installed")
def test_the_package_is_listed_with_its_components() -> None:
    by_name = {info.name: info for info in list_plugins(import_components=True)}
    info = by_name["example_estimator"]
    assert (info.distribution, info.status) == ("tactile-example-estimator", "ok")
    assert info.components == {"estimator": ("volume",)}


@pytest.mark.usefixtures("installed")
def test_its_estimator_runs_in_a_chain_on_a_height_map() -> None:
    cls = resolve("estimator", "example_estimator.volume")
    context = SensorContext(ImageSection(width_px=30, height_px=20, mm_per_px=0.1), Gel())
    steps = Chain({"volume": cls(cls.Options.model_validate({"min_height_mm": 0.1}), context)})
    height = np.zeros((20, 30), np.float32)
    height[5:15, 10:20] = 0.5
    height[0, 0] = 0.05
    result = steps.run({HeightMap: HeightMap(height, np.ones((20, 30), np.bool_), 0.1)})
    volume = result.steps["volume"]
    assert volume.summary() == {"pressed_volume_mm3": pytest.approx(0.5)}
    assert result.by_type[type(volume)] is volume
    assert type(volume).__module__ == f"{MODULE}.volume"


def test_its_own_tests_pass(installed: list[Path]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"],
        cwd=PROJECT,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*map(str, installed), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
