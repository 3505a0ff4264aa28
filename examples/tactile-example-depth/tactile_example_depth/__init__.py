"""The plugin ``example_depth``: a calibration whose model gives depth, ``example_depth.ridge``."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    """What a profile names under ``calibration``."""
    return {"ridge": "tactile_example_depth.ridge_depth:RidgeDepthCalibrator"}


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """What is fitted, as a bundle names it."""
    return {"ridge": "tactile_example_depth.ridge_depth:RidgeDepth"}
