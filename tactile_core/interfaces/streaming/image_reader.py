"""The thread that reads a camera's images as they come."""

from __future__ import annotations

from abc import ABC, abstractmethod
from threading import Event, Thread
from typing import ClassVar, NamedTuple

from tactile_core.errors import CameraTimeout, DeviceError, words_of
from tactile_core.interfaces.streaming.encoded_image import EncodedImage, TornImage
from tactile_core.interfaces.streaming.image_queue import ImageQueue
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
