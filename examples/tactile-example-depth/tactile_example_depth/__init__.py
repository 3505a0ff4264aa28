"""The plugin ``example_depth``: a calibration that measures depth, ``example_depth.ridge``."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    """Return the calibrators by their name in profiles."""
    return {"ridge": "tactile_example_depth.ridge_depth:RidgeDepthCalibrator"}


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """Return the fitted models by their name in bundles."""
    return {"ridge": "tactile_example_depth.ridge_depth:RidgeDepth"}
