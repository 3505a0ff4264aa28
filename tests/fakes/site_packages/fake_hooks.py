"""Plugin objects whose hooks break the contract, one way each."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from tactile_core.interfaces.hookspecs import hookimpl


class Misspelt:
    @hookimpl
    def tactile_estimator(self) -> dict[str, str]:
        return {}


class Greedy:
    @hookimpl
    def tactile_cameras(self, config: Any) -> dict[str, str]:
        return {}


class Listing:
    @hookimpl
    def tactile_cameras(self) -> list[str]:
        return ["fake_mylab.still:StillCamera"]


class Failing:
    @hookimpl
    def tactile_cameras(self) -> dict[str, str]:
        raise OSError("the list of cameras is on a drive that is away")


misspelt = Misspelt()
greedy = Greedy()
listing = Listing()
failing = Failing()
unmarked = SimpleNamespace(tactile_cameras=lambda: {"still": "fake_mylab.still:StillCamera"})
empty = SimpleNamespace()
