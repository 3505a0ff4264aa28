"""A plugin whose camera and light driver must not be touched where nothing live is meant."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    return {"camera": "fake_untouchable.devices:Camera"}


@hookimpl
def tactile_light_drivers() -> Mapping[str, str]:
    return {"box": "fake_untouchable.devices:Box"}
