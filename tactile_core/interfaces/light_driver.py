"""The light driver interface: what switches the lights of a live sensor."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING

from tactile_core.interfaces.device import Device

if TYPE_CHECKING:
    from tactile_core.interfaces.camera import Camera


class LightDriver(Device):
    """Switches lights; made and opened only beside a live camera, and dark when it closes.

    Authors write ``_open``, ``_close`` and ``_set``.
    """

    def attach(self, camera: Camera) -> None:
        """Meet the camera, for lights that hang on its handle; called before ``open``."""

    def set(self, levels: Mapping[str, float]) -> None:
        """Shine as told; lights that are not named are dark.

        Parameters
        ----------
        levels : mapping of light to level
            0 is dark, 1 full brightness.

        Raises
        ------
        DeviceError
            The driver is closed, or the lights do not obey.
        ValueError
            A level lies outside 0..1.
        """
        self._require_open()
        for name, level in levels.items():
            if not 0 <= level <= 1:
                raise ValueError(f"light {name!r}: level {level} is outside 0..1")
        self._set(levels)

    def close(self) -> None:
        """Switch every light off and close; does nothing when it is closed already."""
        if self._is_open:
            try:
                self._set({})
            finally:
                super().close()

    @abstractmethod
    def _set(self, levels: Mapping[str, float]) -> None:
        """Shine as told, and return when the light has settled."""
