"""A plugin in good health with a component of some kinds."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    return {"still": "fake_mylab.still:StillCamera"}


@hookimpl
def tactile_illuminations() -> Mapping[str, str]:
    return {"ring": "fake_mylab.ring:Ring"}


@hookimpl
def tactile_light_drivers() -> Mapping[str, str]:
    return {"box": "fake_mylab.ring:Box"}


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    return {"peak": "fake_mylab.peak:Peak", "peak_again": "fake_mylab.peak:Peak"}


@hookimpl
def tactile_profiles() -> Path:
    return Path(__file__).parent / "profiles"
