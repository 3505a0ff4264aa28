"""The public names are there at once, and what defines them is imported on first use."""

from __future__ import annotations

import subprocess
import sys

import pytest

import tactile_core


def test_importing_the_package_imports_no_arrays() -> None:
    code = "import sys, tactile_core; print({'numpy', 'cv2', 'scipy'} & sys.modules.keys())"
    words = [sys.executable, "-c", code]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout == "set()\n"


def test_opening_a_sensor_imports_few_modules_and_none_that_only_some_sensors_need() -> None:
    code = (
        "import sys; from tactile_core import open_sensor\n"
        "print(*(name for name in sys.modules if name.startswith('tactile_core')))"
    )
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    found = set(done.stdout.split())
    assert "tactile_core.pipeline.sensor" in found
    assert len(found) <= 70
    recordings = {name for name in found if name.startswith("tactile_core.recordings")}
    markers = {name for name in found if name.startswith("tactile_core.algorithms.markers")}
    assert recordings | markers == set()


def test_every_name_is_listed_and_found() -> None:
    assert dir(tactile_core) == sorted(set(tactile_core.__all__) - {"__version__"})
    assert all(getattr(tactile_core, name) is not None for name in tactile_core.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="hight_map"):
        tactile_core.hight_map  # type: ignore[attr-defined]  # noqa: B018
