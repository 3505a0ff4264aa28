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


def test_every_name_is_listed_and_found() -> None:
    assert dir(tactile_core) == sorted(set(tactile_core.__all__) - {"__version__"})
    assert all(getattr(tactile_core, name) is not None for name in tactile_core.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="hight_map"):
        tactile_core.hight_map  # type: ignore[attr-defined]  # noqa: B018
