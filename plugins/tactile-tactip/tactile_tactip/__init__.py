"""The TacTip: a dome with pins that a camera watches from inside; plugin ``tactip``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    """Return the virtual sensor."""
    return {"virtual": "tactile_tactip.camera:VirtualTacTip"}


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    """Return what says that light measures no slopes here."""
    return {"no_slopes": "tactile_tactip.no_slopes:NoSlopes"}


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    """Return the steps from pins to the pose of a surface."""
    return {
        "pins": "tactile_tactip.pins:PinMatching",
        "surface": "tactile_tactip.surface:SurfaceEstimator",
    }


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """Return what is fitted to a unit."""
    return {"surface": "tactile_tactip.surface:SurfaceModel"}


@hookimpl
def tactile_commands() -> Mapping[str, str]:
    """Return the command that fits it."""
    return {"calibrate-surface": "tactile_tactip.commands:calibrate_surface"}


@hookimpl
def tactile_profiles() -> Path:
    """Return the folder of the profiles."""
    return Path(__file__).parent / "profiles"
