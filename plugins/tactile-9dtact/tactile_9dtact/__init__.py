"""The 9DTact for tactile-core: the deeper the gel is pressed, the darker is its image."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    """Return the calibrator, which needs one press of a ball."""
    return {"darkness": "tactile_9dtact.darkness:DarknessCalibrator"}


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """Return the model that is fitted, and the one that is imported."""
    return {
        "darkness": "tactile_9dtact.darkness:Darkness",
        "depth_table": "tactile_9dtact.depth_table:DepthTable",
    }


@hookimpl
def tactile_importers() -> Mapping[str, str]:
    """Return the importer of the folder in which the authors' program keeps a calibration."""
    return {"folder": "tactile_9dtact.depth_table:DepthTableImporter"}


@hookimpl
def tactile_profiles() -> Path:
    """Return the folder of the profiles."""
    return Path(__file__).parent / "profiles"
