"""A plugin whose parts do what their options say, however unruly that is."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    return {"camera": "fake_unruly.parts:UnrulyCamera"}


@hookimpl
def tactile_illuminations() -> Mapping[str, str]:
    return {"lights": "fake_unruly.parts:UnrulyLights"}


@hookimpl
def tactile_light_drivers() -> Mapping[str, str]:
    return {"box": "fake_unruly.parts:UnrulyBox"}


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    return {"calibration": "fake_unruly.parts:UnrulyCalibrator"}


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    return {"calibration": "fake_unruly.parts:UnrulyCalibration"}


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    return {
        "step": "fake_unruly.parts:UnrulyStep",
        "measure": "fake_unruly.parts:UnrulyMeasure",
    }
