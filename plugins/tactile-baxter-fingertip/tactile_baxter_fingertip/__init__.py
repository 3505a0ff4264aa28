"""The four-colour fingertip of the Baxter gripper (Li et al. 2014) for tactile-core."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    """Return the calibrator that maps hue and intensity to normals."""
    return {"hue_intensity": "tactile_baxter_fingertip.hue_intensity:HueIntensityCalibrator"}


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """Return the model that it fits."""
    return {"hue_intensity": "tactile_baxter_fingertip.hue_intensity:HueIntensity"}
