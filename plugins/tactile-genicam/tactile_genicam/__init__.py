"""Machine-vision cameras by the GenICam standard, for tactile-core."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    """Return the camera."""
    return {"camera": "tactile_genicam.camera:GenicamCamera"}
