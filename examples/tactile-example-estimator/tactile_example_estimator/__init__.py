"""The plugin ``example_estimator``: one estimator, ``example_estimator.volume``."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    """Return the estimators by name; each is imported only when a profile uses it."""
    return {"volume": "tactile_example_estimator.volume:PressedVolume"}
