"""Image sources whose images and faults a test decides."""

from __future__ import annotations

from collections.abc import Iterable
from queue import Empty, Queue
from threading import Event
from typing import ClassVar

import numpy as np

from tactile_core.errors import CameraTimeout
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.streaming.encoded_image import EncodedImage, TornImage
from tactile_core.interfaces.streaming.streaming_camera import ImageSource, StreamingCamera
from tactile_core.quantities import Image


def numbered(number: int, timestamp_s: float | None = None) -> Image:
    """Return a small image that shows its number; by default one per second."""
    pixels = np.full((2, 3, 3), number % 256, np.uint8)
    return Image(pixels, timestamp_s=float(number) if timestamp_s is None else timestamp_s)


class Scripted(ImageSource):
    """Gives what a test puts in: images, exceptions and None for the end; then it stalls."""

    def __init__(self, given: Iterable[Image | EncodedImage | BaseException | None] = ()) -> None:
        self._given: Queue[Image | EncodedImage | BaseException | None] = Queue()
        self._interrupted = Event()
        self.closed = 0
        self.closing_error: Exception | None = None
        for one in given:
            self.give(one)

    def give(self, one: Image | EncodedImage | BaseException | None) -> None:
        self._given.put(one)

    def grab(self) -> Image | EncodedImage | None:
        if self._interrupted.is_set():
            raise CameraTimeout("interrupted")
        try:
            one = self._given.get(timeout=0.005)
        except Empty:
            raise CameraTimeout("nothing yet") from None
        if isinstance(one, BaseException):
            raise one
        return one

    def interrupt(self) -> None:
        self._interrupted.set()

    def close(self) -> None:
        self.closed += 1
        if self.closing_error is not None:
            raise self.closing_error


class Patient(Scripted):
    """A source whose images wait until they are grabbed, as those in a folder do."""

    waits: ClassVar[bool] = True


class ScriptedCamera(StreamingCamera):
    """A streaming camera around such a source; a new source for each opening."""

    def __init__(self, *given: Image | EncodedImage | BaseException | None) -> None:
        super().__init__(Options())
        self._script = given
        self.sources: list[Scripted] = []

    def _connect(self) -> ImageSource:
        self.sources.append(Scripted(self._script))
        return self.sources[-1]


TORN = TornImage("half an image")
