"""The camera interface: a source of images, its statistics, and its controls."""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from threading import Lock
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol, Self, runtime_checkable
from weakref import WeakValueDictionary

from pydantic import BaseModel

from tactile_core.errors import DeviceBusy, DeviceError
from tactile_core.interfaces.device import Device
from tactile_core.quantities import Image

if TYPE_CHECKING:
    from tactile_core.interfaces.component import SensorBuild
    from tactile_core.interfaces.illumination import Exposure


# What happens to an image that is unread when the next one arrives.
Drop = Literal["oldest", "never"]

# The camera object that last opened each device, by device id; shared by the whole process.
_HOLDERS: WeakValueDictionary[str, Camera] = WeakValueDictionary()

_CLAIMING = Lock()


class Trigger(Enum):
    """What advances an observation from one exposure to the next.

    Attributes
    ----------
    SOFTWARE
        Acquisition sets the lights, then reads a new exposure, which begins with ``expose`` or
        ``read``.
    FREE_RUNNING
        The camera takes images on its own. Acquisition sets the lights and reads until an image's
        timestamp proves that its exposure began after they had settled.
    CAMERA
        The camera strobes or triggers the lights itself, or plays back such a recording. Each
        image carries its ``exposure_index``, or the images arrive in the order of the sequence.
    """

    SOFTWARE = "software"
    FREE_RUNNING = "free-running"
    CAMERA = "camera"


class Camera(Device):
    """A source of exposures.

    Implement ``_open``, ``_close`` and ``_read``; also ``_arm`` if exposure time or gain can
    change between exposures, and ``device_id`` if several such cameras can be connected.

    Attributes
    ----------
    live : bool
        True for a camera that shows a device in real time; False for a recording or a virtual
        sensor, which need no light driver.
    """

    live: ClassVar[bool] = True

    @classmethod
    def for_build(cls, options: BaseModel, build: SensorBuild) -> Self:
        """Make the camera of a sensor build; override it if the options alone are not enough."""
        return cls(options)

    @property
    def device_id(self) -> str:
        """Serial number, port or address of the device; "" if unknown.

        It may become known only once the camera is open.
        """
        return ""

    def open(self) -> Self:
        """Open the camera; do nothing if it is already open.

        Raises
        ------
        DeviceBusy
            The device is in use by another process or by another object of this process.
        DeviceError
            The device is absent or cannot be opened; nothing is left open.
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
        """Prepare for the exposures of an observation; called before the first one is read.

        Returns
        -------
        Trigger
            What advances from one exposure to the next.

        Raises
        ------
        DeviceError
            The camera is closed, or cannot take these exposures.
        """
        self._require_open()
        return self._arm(tuple(exposures))

    @property
    def stamp_delay_s(self) -> float | None:
        """Longest time from the beginning of an exposure to its timestamp, s; None if unknown.

        That of the first row for a rolling shutter. Acquisition measures it for a free-running
        camera that does not know it.
        """
        return None

    def prepare(self, exposure: Exposure) -> None:
        """Apply the settings of the next exposure, if the exposures have settings of their own.

        Raises
        ------
        DeviceError
            The camera is closed or refuses them.
        """
        self._require_open()
        self._prepare(exposure)

    def expose(self, timeout_s: float = 1.0) -> bool:
        """Take an exposure with :attr:`Trigger.SOFTWARE` and leave its image to :meth:`read`.

        Returns
        -------
        bool
            True once the exposure has ended, so that the lights may change while its image is
            read out. False if the camera cannot do so; then ``read`` takes the exposure.

        Raises
        ------
        DeviceError
            The camera is closed, or failed.
        """
        self._require_open()
        return self._expose(timeout_s)

    def read(self, timeout_s: float = 1.0) -> Image | None:
        """Return the next exposure; None at the end of a recording.

        Blocks for at most ``timeout_s``.

        Raises
        ------
        DeviceError
            The camera is closed.
        CameraTimeout
            No new exposure arrived within ``timeout_s``.
        CameraLost
            The camera was disconnected.
        """
        self._require_open()
        return self._read(timeout_s)

    def latest(self, max_age_s: float) -> Image | None:
        """Return the newest image; None at the end of a recording.

        Blocks for at most ``max_age_s``. The image stays unread for :meth:`read`. A camera that
        takes its images on request takes and returns the next one.

        Raises
        ------
        DeviceError
            The camera is closed.
        CameraTimeout
            There is no image that is at most ``max_age_s`` old.
        CameraLost
            The camera was disconnected.
        """
        self._require_open()
        return self._latest(max_age_s)

    def set_drop(self, drop: Drop | None) -> None:
        """Choose what happens to images that arrive before earlier ones are read.

        Parameters
        ----------
        drop : {"oldest", "never"} or None
            ``"oldest"`` drops unread images, so that what is read is always new. ``"never"``
            queues them, and ends with an error once they no longer fit into memory. None: the
            default of the camera. Without effect on a camera that takes images on request.
        """

    @property
    def nominal_rate_hz(self) -> float | None:
        """Images a second that the open camera is set to send; None if it does not know."""
        return None

    @property
    def statistics(self) -> StreamStatistics | None:
        """What has arrived since the camera was opened; None if it takes images on request."""
        return None

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know about the open camera, such as a rate that it chose itself."""
        return ()

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        """Prepare for these exposures; the default is for a camera with fixed settings."""
        if any(one.exposure_time_s is not None or one.gain is not None for one in exposures):
            raise DeviceError(
                f"{type(self).__name__} cannot change its exposure time or gain from one exposure "
                f"to the next; leave them out of the illumination's exposures"
            )
        return Trigger.SOFTWARE

    def _prepare(self, exposure: Exposure) -> None:
        """Apply the exposure's own settings; the default is for a camera with fixed settings."""

    def _expose(self, timeout_s: float) -> bool:
        """Take an exposure and return before it is read out; the default cannot."""
        return False

    @abstractmethod
    def _read(self, timeout_s: float) -> Image | None:
        """Return one exposure, or None at the end of a recording."""

    def _latest(self, max_age_s: float) -> Image | None:
        """Return the newest image, at most ``max_age_s`` old, or None at a recording's end."""
        return self._read(max_age_s)

    def _claim(self) -> None:
        with _CLAIMING:
            self._refuse_a_second()
            if self.device_id:
                _HOLDERS[self.device_id] = self

    def _refuse_a_second(self) -> None:
        holder = _HOLDERS.get(self.device_id)
        if holder is not None and holder is not self and holder.is_open:
            raise DeviceBusy(
                f"the device {self.device_id!r} is already open in this process, by another "
                f"{type(holder).__name__}; close that one first, or name another device"
            )


@runtime_checkable
class ControlledCamera(Protocol):
    """A camera with controls, by name: ``zoom``, ``focus``, ``gain`` and so on."""

    @property
    def is_open(self) -> bool:
        """Whether the camera is open."""

    def set_control(self, name: str, value: int) -> int:
        """Set a control, and return its value as the camera reports it afterwards.

        Raises
        ------
        DeviceError
            The camera is closed or disconnected, or has no such control.
        """


@dataclass(frozen=True)
class StreamStatistics:
    """What has arrived from a camera since it was opened.

    Attributes
    ----------
    received : int
        Whole images with a time of their own, including those that were dropped.
    dropped : int
        Images that nobody read, because newer ones arrived first.
    repeated : int
        Images that equal the one before in every byte, or have its timestamp. An image with the
        same timestamp is the same exposure and is left out; equal bytes alone can be a dark scene.
    torn : int
        Images that arrived incomplete or could not be decoded; they are left out.
    rate_hz : float
        Measured rate of the images of the last two seconds; 0 if there are fewer than two.
    """

    received: int = 0
    dropped: int = 0
    repeated: int = 0
    torn: int = 0
    rate_hz: float = 0.0


class RateMeter:
    """Measures the rate of events from their times.

    Parameters
    ----------
    window_s : float
        Only events of this last time count, so that a stall is visible soon.
    """

    def __init__(self, window_s: float) -> None:
        self._window_s = window_s
        self._times_s: deque[float] = deque()

    def add(self, time_s: float) -> None:
        """Record an event."""
        self._times_s.append(time_s)
        self._forget(time_s)

    def rate_hz(self, now_s: float) -> float:
        """Return the mean rate of the events within the window; 0 for fewer than two."""
        self._forget(now_s)
        if len(self._times_s) < 2 or self._times_s[-1] <= self._times_s[0]:
            return 0.0
        return (len(self._times_s) - 1) / (self._times_s[-1] - self._times_s[0])

    def _forget(self, now_s: float) -> None:
        while self._times_s and self._times_s[0] < now_s - self._window_s:
            self._times_s.popleft()
