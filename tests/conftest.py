"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Folder of real recordings, or skip."""
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = Path(os.environ.get("TACTILE_TEST_DATA", default))
    if not folder.is_dir():
        pytest.skip("no real recordings here; set TACTILE_TEST_DATA to the folder that holds them")
    return folder
