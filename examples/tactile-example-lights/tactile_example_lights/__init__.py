"""The plugin ``example_lights``: a camera, a light driver and a journal of readings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    """Return the cameras by name."""
    return {"camera": "tactile_example_lights.camera:BenchCamera"}


@hookimpl
def tactile_light_drivers() -> Mapping[str, str]:
    """Return the light drivers by name."""
    return {"box": "tactile_example_lights.box:LightBox"}


@hookimpl
def tactile_sinks() -> Mapping[str, str]:
    """Return the sinks by name."""
    return {"journal": "tactile_example_lights.journal:Journal"}


@hookimpl
def tactile_profiles() -> Path:
    """Return the folder of the profile ``example_lights_bench``."""
    return Path(__file__).parent / "profiles"
