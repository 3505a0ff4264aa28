"""Steps that run a trained network in an ONNX file, for tactile-core."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    """Return the steps."""
    return {
        "force_cnn": "tactile_networks.steps:ForceNetwork",
        "onnx": "tactile_networks.steps:Onnx",
    }
