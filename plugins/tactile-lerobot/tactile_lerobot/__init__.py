"""Readings as a LeRobot v3 data set, for tactile-core; needs neither LeRobot nor PyTorch."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_sinks() -> Mapping[str, str]:
    """Return the sink that writes a data set."""
    return {"dataset": "tactile_lerobot.dataset:Dataset"}
