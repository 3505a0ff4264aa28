"""The camera interface: one exposure after another, each with its time."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import Enum
from threading import Lock
from typing import TYPE_CHECKING, ClassVar, Self
from weakref import WeakValueDictionary

from pydantic import BaseModel

from tactile_core.errors import DeviceBusy, DeviceError
from tactile_core.interfaces.device import Device
from tactile_core.quantities import Image

if TYPE_CHECKING:
    from tactile_core.interfaces.component import SensorBuild
    from tactile_core.interfaces.illumination import Exposure

_HOLDERS: WeakValueDictionary[str, Camera] = WeakValueDictionary()
"""Who opened each device last: devices belong to the process, and so does this."""

_CLAIMING = Lock()


class Trigger(Enum):
    """Who goes from one exposure of an observation to the next.

    Attributes
    ----------
    SOFTWARE
        Acquisition sets the lights, then reads a fresh exposure.
    CAMERA
        The camera: it strobes or triggers the lights itself, or plays what was taken so. Each image
        tells its ``exposure_index``, or they come in the order of the sequence.
    """

    SOFTWARE = "software"
    CAMERA = "camera"


class Camera(Device):
    """A source of exposures.

    Authors write ``_open``, ``_close`` and ``_read``; ``_arm`` if the camera can do more than take
    one picture like the other, and ``device_id`` if there can be several of them.

    Attributes
    ----------
    live : bool
        False for a camera that shows no device of the present moment, but a recording or a virtual
        sensor. Beside it no light driver is made.
    """

    live: ClassVar[bool] = True

    @classmethod
    def of(cls, options: BaseModel, build: SensorBuild) -> Self:
        """Make the camera of a sensor build; for those that need more than their options."""
        return cls(options)

    @property
    def device_id(self) -> str:
        """The device's serial number, or what stands for it: a port, an address; "" if nothing.

        It may become known only when the camera is open.
        """
        return ""

    def open(self) -> Self:
        """Open the camera; does nothing when it is open already.

        Raises
        ------
        DeviceBusy
            The device is in use, by another process or by another object of this one.
        DeviceError
            It is absent or refuses; nothing is left open.
        """
        if not self._is_open:
            self._refuse_a_second()
            super().open()
            try:
                self._claim()
            except BaseException as error:
                self._is_open = False
                self._release_after(error)
                raise
        return self

    def arm(self, exposures: Sequence[Exposure]) -> Trigger:
        """Prepare for the exposures of an observation; called before the first of them is read.

        Returns
        -------
        Trigger
            Who goes from one exposure to the next.

        Raises
        ------
        DeviceError
            The camera is closed, or cannot take these exposures.
        """
        self._require_open()
        return self._arm(tuple(exposures))

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

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        """Prepare for these exposures; here for a camera that takes one like the other."""
        if any(one.exposure_time_s is not None or one.gain is not None for one in exposures):
            raise DeviceError(
                f"{type(self).__name__} cannot change its exposure time or gain from one exposure "
                f"to the next; leave them out of the illumination's exposures"
            )
        return Trigger.SOFTWARE

    @abstractmethod
    def _read(self, timeout_s: float) -> Image | None:
        """Deliver one exposure, or None at the end of a recording."""

    def _claim(self) -> None:
        with _CLAIMING:
            self._refuse_a_second()
            if self.device_id:
                _HOLDERS[self.device_id] = self

    def _refuse_a_second(self) -> None:
        holder = _HOLDERS.get(self.device_id)
        if holder is not None and holder is not self and holder.is_open:
            raise DeviceBusy(
                f"the device {self.device_id!r} is open already in this process, by another "
                f"{type(holder).__name__}; close that one first, or name another device"
            )
