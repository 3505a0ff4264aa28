"""The plugin ``example_lights``: a camera, the box that switches the lights, and a journal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    """The camera over the gel."""
    return {"camera": "tactile_example_lights.camera:BenchCamera"}


@hookimpl
def tactile_light_drivers() -> Mapping[str, str]:
    """The box beside it."""
    return {"box": "tactile_example_lights.box:LightBox"}


@hookimpl
def tactile_sinks() -> Mapping[str, str]:
    """Where readings may go."""
    return {"journal": "tactile_example_lights.journal:Journal"}


@hookimpl
def tactile_profiles() -> Path:
    """``example_lights_bench``."""
    return Path(__file__).parent / "profiles"
