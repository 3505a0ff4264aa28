"""Cameras that stream: a thread reads their images into a queue."""

from __future__ import annotations

import time
import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable
from threading import Event, Thread
from typing import ClassVar, NamedTuple

from pydantic import BaseModel

from tactile_core.errors import CameraTimeout, DeviceError, words_of
from tactile_core.interfaces.camera import Camera, Drop, StreamStatistics, Trigger
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.streaming.encoded_image import EncodedImage, TornImage
from tactile_core.interfaces.streaming.image_queue import ImageQueue, Tap
from tactile_core.quantities import Image


class ReaderParameters(NamedTuple):
    """Times of a reader thread.

    Attributes
    ----------
    room_s : float, s
        Interval at which a full queue is looked at again. Source: a third of a frame period at
        30 Hz, so that waiting costs no frame rate.
    join_s : float, s
        Longest wait for the thread when it is closed. Source: the ten seconds for which OpenCV
        waits for a V4L2 camera by default, and half as much again as reserve on a busy
        machine.
    """

    room_s: float = 0.01
    join_s: float = 15.0


class ImageSource(ABC):
    """A connected camera, as the reader's thread sees it.

    Attributes
    ----------
    waits : bool
        Whether images that are not grabbed stay where they are, as those in a folder do.
    """

    waits: ClassVar[bool] = False

    @abstractmethod
    def grab(self) -> Image | EncodedImage | None:
        """Wait for the next image; return None if there will be none.

        A compressed image is decoded by whoever reads it: time spent here is missing for the next
        one. ``timestamp_s`` and ``wall_time_s`` are set (see ``wall_time_at``), and timestamps of
        different exposures differ. The queue numbers the images.

        Raises
        ------
        CameraTimeout
            None has come yet; grab again.
        TornImage
            The image is damaged; grab again.
        CameraLost
            The camera is gone.
        """

    def interrupt(self) -> None:  # noqa: B027
        """Let a :meth:`grab` that waits in another thread return or fail soon."""

    @abstractmethod
    def close(self) -> None:
        """Release the camera; called once, by the thread that grabs."""


class ImageReader:
    """Moves images from a source into a queue, in a thread of its own, until it is closed.

    The thread closes the source itself, so a driver is never called from two threads.

    Parameters
    ----------
    source : ImageSource
        Belongs to the reader from now on.
    queue : ImageQueue
    name : str
        Of the thread.
    """

    def __init__(
        self,
        source: ImageSource,
        queue: ImageQueue,
        name: str,
        parameters: ReaderParameters = ReaderParameters(),  # noqa: B008
    ) -> None:
        self._source, self._queue, self._parameters = source, queue, parameters
        self._stopped = Event()
        self._closing_error: Exception | None = None
        self._thread = Thread(target=self._run, name=f"reader of {name}", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ask the thread to end, without waiting for it."""
        self._stopped.set()
        self._source.interrupt()

    def close(self) -> None:
        """End the thread, wait for it and release the source.

        Raises
        ------
        DeviceError
            The source cannot be closed, or its driver does not return.
        """
        self.stop()
        self._thread.join(self._parameters.join_s)
        if self._thread.is_alive():
            raise DeviceError(
                f"the driver of the {self._thread.name} has not returned for "
                f"{self._parameters.join_s:g} s; unplug the camera, which ends it"
            )
        if self._closing_error is not None:
            error, self._closing_error = self._closing_error, None
            raise DeviceError(f"the camera does not close: {words_of(error)}") from error

    def _run(self) -> None:
        try:
            self._grab_all()
        except BaseException as error:  # raised again in the thread that reads
            self._queue.end(error)
        else:
            self._queue.end()
        try:
            self._source.close()
        except Exception as error:
            self._closing_error = error

    def _grab_all(self) -> None:
        while not self._stopped.is_set():
            if self._source.waits and self._queue.drop == "never" and not self._queue.has_room():
                self._stopped.wait(self._parameters.room_s)
                continue
            try:
                image = self._source.grab()
            except CameraTimeout:
                continue
            except TornImage:
                self._queue.put_torn()
                continue
            if image is None or not self._queue.put(image):
                return


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
