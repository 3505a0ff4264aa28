"""Base class of cameras that send images on their own."""

from __future__ import annotations

import time
import weakref
from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar

from pydantic import BaseModel

from tactile_core.interfaces.camera import Camera, Drop, Trigger
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.stream_statistics import StreamStatistics
from tactile_core.interfaces.streaming.image_queue import ImageQueue, Tap
from tactile_core.interfaces.streaming.image_reader import ImageReader, ImageSource
from tactile_core.quantities import Image


class StreamingCamera(Camera):
    """A camera whose images one reader thread takes as they come.

    Implement ``_connect``. Images are read in order, and each is read at most once. The thread
    ends with :meth:`close`, or when the camera object is forgotten.

    Attributes
    ----------
    default_drop : {"oldest", "never"}
        What happens to unread images unless :meth:`set_drop` changes it.
    """

    default_drop: ClassVar[Drop] = "oldest"

    def __init__(self, options: BaseModel) -> None:
        super().__init__(options)
        self._drop: Drop = self.default_drop
        self._taps: tuple[Tap, ...] = ()
        self._queue = ImageQueue(type(self).__name__)
        self._reader: ImageReader | None = None

    def set_drop(self, drop: Drop | None) -> None:
        """Choose what happens to images that arrive before earlier ones are read."""
        self._drop = self.default_drop if drop is None else drop
        self._queue.drop = self._drop

    def add_tap(self, tap: Tap) -> None:
        """Pass each image on as it arrives, before it is decoded or dropped; unread ones at once.

        Parameters
        ----------
        tap : callable
            Called in the reader's thread; it must return at once and never raise. It stays when
            the camera is opened again.
        """
        self._taps = (*self._taps, tap)
        self._queue.add_tap(tap)

    def remove_tap(self, tap: Tap) -> None:
        """Pass no more images on to it."""
        self._taps = tuple(one for one in self._taps if one != tap)
        self._queue.remove_tap(tap)

    @property
    def statistics(self) -> StreamStatistics:
        """Rate, and dropped, repeated and torn images, since the camera was opened."""
        return self._queue.statistics

    @abstractmethod
    def _connect(self) -> ImageSource:
        """Acquire the device; if that fails, leave nothing open."""

    @property
    def _name(self) -> str:
        """The camera in messages, once it is connected."""
        return f"the camera {self.device_id}" if self.device_id else type(self).__name__

    def _open(self) -> None:
        source = self._connect()
        self._queue = ImageQueue(self._name, self._drop, taps=self._taps)
        try:
            self._reader = ImageReader(source, self._queue, self._name)
        except BaseException:
            source.close()
            raise
        weakref.finalize(self, self._reader.stop).atexit = False

    def _close(self) -> None:
        reader, self._reader = self._reader, None
        if reader is not None:
            reader.close()

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        super()._arm(exposures)  # refuses settings of their own
        return Trigger.FREE_RUNNING

    def _read(self, timeout_s: float) -> Image | None:
        return self._queue.next(timeout_s)

    def _read_triggered(self, trigger: Callable[[], None], timeout_s: float) -> Image | None:
        """Trigger an exposure and return its image; one of an earlier trigger is left out.

        Raises
        ------
        CameraTimeout
            It does not come within ``timeout_s``.
        """
        triggered_s = time.monotonic()
        trigger()
        while True:
            left_s = max(0.0, triggered_s + timeout_s - time.monotonic())
            image = self._queue.next(left_s)
            # the exposure's end, because its middle may be estimated from it
            if image is None or image.timestamp_s + (image.exposure_time_s or 0) / 2 > triggered_s:
                return image

    def _latest(self, max_age_s: float) -> Image | None:
        return self._queue.latest(max_age_s)
