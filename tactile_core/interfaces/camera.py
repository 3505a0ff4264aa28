"""The camera interface: one exposure after another, each with its time."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Self

from pydantic import BaseModel

from tactile_core.interfaces.device import Device
from tactile_core.quantities import Image

if TYPE_CHECKING:
    from tactile_core.interfaces.component import SensorBuild


class Camera(Device):
    """A source of exposures.

    Authors write ``_open``, ``_close`` and ``_read``.
    """

    @classmethod
    def of(cls, options: BaseModel, build: SensorBuild) -> Self:
        """Make the camera of a sensor build; for those that need more than their options."""
        return cls(options)

    def read(self, timeout_s: float = 1.0) -> Image | None:
        """Return the next exposure; None when a recording has come to its end.

        Blocks for ``timeout_s`` at the most.

        Raises
        ------
        DeviceError
            The camera is closed.
        CameraTimeout
            No fresh exposure within ``timeout_s``.
        CameraLost
            The camera went away.
        """
        self._require_open()
        return self._read(timeout_s)

    @abstractmethod
    def _read(self, timeout_s: float) -> Image | None:
        """Deliver one exposure, or None at the end of a recording."""
