"""Light drivers that each do one thing wrong."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.errors import DeviceError
from tactile_core.interfaces.light_driver import LightDriver


class Box(LightDriver):
    """Two lights; sound."""

    def _open(self) -> None:
        self._shining: dict[str, float] = {}

    def _close(self) -> None:
        pass

    def _set(self, levels: Mapping[str, float]) -> None:
        self._shining = dict(levels)


class Disobedient(Box):
    def _set(self, levels: Mapping[str, float]) -> None:
        if levels:
            raise DeviceError("no light of this name")


class Unguarded(Box):
    def set(self, levels: Mapping[str, float]) -> None:
        self._set(levels)


class StaysLit(Box):
    def close(self) -> None:
        self._is_open = False
        self._close()


class StaysBusy(Box):
    def __init__(self, options: object) -> None:
        super().__init__(options)
        self._busy = False

    def _open(self) -> None:
        if self._busy:
            raise DeviceError("port in use")
        self._busy = True
