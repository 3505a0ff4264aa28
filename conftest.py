"""Fixtures shared by all tests."""

from __future__ import annotations

import gc
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings
from support.own_plugins import install  # noqa: F401

from tactile_core.pipeline.one_thread import ONE_THREAD

if TYPE_CHECKING:
    from support.virtual_lab import VirtualLab

# Set before numpy and OpenCV are imported.
for name, value in ONE_THREAD.items():
    os.environ.setdefault(name, value)

# A background job ignores SIGINT, and so would every command that a test interrupts.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Use the same examples in every run, so that a failure is reproducible.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


def pytest_collection_finish() -> None:
    """Leave thousands of tests, which live until the end, out of every collection of garbage."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Return the folder of real recordings; skip the test if there is none."""
    default = Path(__file__).resolve().parents[1] / "shared" / "data"
    folder = Path(os.environ.get("TACTILE_TEST_DATA", default))
    if not folder.is_dir():
        pytest.skip("no real recordings found; set TACTILE_TEST_DATA to their folder")
    return folder


@pytest.fixture(scope="session")
def lab(tmp_path_factory: pytest.TempPathFactory) -> VirtualLab:
    """A virtual sensor, calibrated once for all tests."""
    from support.virtual_lab import make_lab

    return make_lab(tmp_path_factory.mktemp("lab"))
