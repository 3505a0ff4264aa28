"""The plugin ``example_depth``: calibrations that measure depth, without gradients in between.

``example_depth.ridge`` integrates intensity changes; ``example_depth.darkness`` is for a
translucent gel that darkens with depth.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    """Return the calibrators by their name in profiles."""
    return {
        "ridge": "tactile_example_depth.ridge_depth:RidgeDepthCalibrator",
        "darkness": "tactile_example_depth.darkness:DarknessCalibrator",
    }


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """Return the fitted models by their name in bundles."""
    return {
        "ridge": "tactile_example_depth.ridge_depth:RidgeDepth",
        "darkness": "tactile_example_depth.darkness:Darkness",
    }


@hookimpl
def tactile_profiles() -> Path:
    """Return the folder of this plugin's profiles."""
    return Path(__file__).parent / "profiles"
