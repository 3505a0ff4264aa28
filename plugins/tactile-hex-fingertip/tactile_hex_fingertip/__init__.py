"""The hexagonal three-colour fingertip (Dong, Yuan, Adelson 2017) for tactile-core."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_illuminations() -> Mapping[str, str]:
    """Return the illumination of the fingertip."""
    return {"tricolour": "tactile_hex_fingertip.tricolour:Tricolour"}
