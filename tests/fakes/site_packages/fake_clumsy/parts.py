"""Things that are not what the plugin says."""

from __future__ import annotations

from tactile_core.interfaces.camera import Camera


class NotAnEstimator:
    pass


def function() -> None:
    pass


class UnfinishedCamera(Camera):
    def _open(self) -> None:
        pass
