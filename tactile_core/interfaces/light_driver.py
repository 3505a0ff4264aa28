"""The light driver interface: switches the lights of a live sensor."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING

from tactile_core.interfaces.device import Device

if TYPE_CHECKING:
    from tactile_core.interfaces.camera import Camera


class LightDriver(Device):
    """Switches the lights of a live camera, and switches them off when it closes.

    Implement ``_open``, ``_close`` and ``_set``.
    """

    def attach(self, camera: Camera) -> None:
        """Receive the camera, for lights that are driven through it; called before ``open``."""

    @property
    def watchdog_s(self) -> float | None:
        """Time after which the lights go out by themselves if the program is killed, s.

        None for lights that stay on: the device has no watchdog.
        """
        return None

    def check(self) -> None:
        """Check that the lights still have the levels that were set.

        Raises
        ------
        DeviceError
            The driver is closed, or the lights may have gone out since.
        """
        self._require_open()
        self._check()

    def set(self, levels: Mapping[str, float]) -> None:
        """Set the brightness of the lights; lights that are not named are switched off.

        Parameters
        ----------
        levels : mapping of light to level
            0 is off, 1 is full brightness.

        Raises
        ------
        DeviceError
            The driver is closed, or the lights do not respond.
        ValueError
            A level is outside 0..1.
        """
        self._require_open()
        for name, level in levels.items():
            if not 0 <= level <= 1:
                raise ValueError(f"light {name!r}: level {level} is outside 0..1")
        self._set(levels)

    def close(self) -> None:
        """Switch every light off and close; do nothing if it is already closed."""
        if self._is_open:
            try:
                self._set({})
            finally:
                super().close()

    def _check(self) -> None:
        """Raise what has become known since the last ``_set``; the default knows nothing."""

    @abstractmethod
    def _set(self, levels: Mapping[str, float]) -> None:
        """Set these levels, and return once the light has settled."""
