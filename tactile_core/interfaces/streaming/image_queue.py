"""The queue of unread images between a reader thread and the program that measures them."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from threading import Condition
from typing import NamedTuple

import numpy as np

from tactile_core.errors import CameraTimeout, DeviceError
from tactile_core.interfaces.camera import Drop
from tactile_core.interfaces.stream_statistics import RateMeter, StreamStatistics
from tactile_core.quantities import Image


class QueueParameters(NamedTuple):
    """Sizes of a queue of images.

    Attributes
    ----------
    unread : int, images
        Unread images that are kept when the oldest is dropped. Source: a program that measures
        more slowly than the camera sends then reads images that are at most one frame period old.
    never_bytes : int, bytes
        Unread pixels that are kept when none is dropped. Source: 500 images of 640 × 480 pixels in
        colour, a pause of 15 s at 30 Hz, which fits into the memory of a small computer.
    window_s : float, s
        Time over which the rate is measured. Source: 60 images at 30 Hz, so that one image more or
        less changes the rate by less than 2 %.
    """

    unread: int = 1
    never_bytes: int = 460_800_000
    window_s: float = 2.0


class ImageQueue:
    """Images that a reader has put and nobody has read, and statistics of all that came.

    The reader's thread calls :meth:`has_room`, :meth:`put`, :meth:`put_torn` and :meth:`end`, any
    other thread the rest.

    Parameters
    ----------
    name : str
        Of the camera, in messages.
    drop : {"oldest", "never"}
        What happens to unread images; may be changed at any time.
    clock : callable
        Returns the time of the timestamps, s.
    """

    def __init__(
        self,
        name: str,
        drop: Drop = "oldest",
        parameters: QueueParameters = QueueParameters(),  # noqa: B008
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.drop = drop
        self._name, self._parameters, self._clock = name, parameters, clock
        self._changed = Condition()
        self._unread: deque[Image] = deque()
        self._newest: Image | None = None
        self._ended = False
        self._error: BaseException | None = None
        self._counts = StreamStatistics()
        self._meter = RateMeter(parameters.window_s)

    def has_room(self) -> bool:
        """Return whether another image fits without dropping one."""
        with self._changed:
            return self._has_room()

    def put(self, image: Image) -> bool:
        """Add the camera's next image; return whether the stream goes on.

        The queue numbers the images. If none may be dropped and there is no room, the stream ends
        with an error: a gap that nobody notices would be worse.
        """
        with self._changed:
            if self._ended:
                return False
            before, counts = self._newest, self._counts
            again = before is not None and image.timestamp_s <= before.timestamp_s
            if again or (before is not None and _equal(image, before)):
                counts = replace(counts, repeated=counts.repeated + 1)
            if not again:
                image = replace(image, sequence=counts.received + counts.torn)
                counts = replace(counts, received=counts.received + 1)
                counts = self._add(image, counts)
            self._counts = counts
            self._changed.notify_all()
            return not self._ended

    def put_torn(self) -> None:
        """Count an image that is damaged."""
        with self._changed:
            self._counts = replace(self._counts, torn=self._counts.torn + 1)

    def end(self, error: BaseException | None = None) -> None:
        """End the stream: with None as after a recording, or with an error."""
        with self._changed:
            if not self._ended:
                self._ended, self._error = True, error
                self._changed.notify_all()

    def next(self, timeout_s: float) -> Image | None:
        """Return the oldest unread image; None at the end of the stream.

        Raises
        ------
        CameraTimeout
            No image came within ``timeout_s``.
        BaseException
            The error with which the stream ended.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._unread or self._ended, timeout_s)
            if self._unread:
                return self._unread.popleft()
            self._raise_reason(f"sent no image within {timeout_s:g} s")
            return None

    def latest(self, max_age_s: float) -> Image | None:
        """Return the newest image, read or unread; None at the end of the stream.

        It stays unread. If the newest is older than ``max_age_s``, a newer one is awaited for at
        most that time.

        Raises
        ------
        CameraTimeout
            There is no image that is new enough.
        BaseException
            The error with which the stream ended.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._is_new(max_age_s) or self._ended, max_age_s)
            if self._is_new(max_age_s):
                return self._newest
            self._raise_reason(f"has no image that is at most {max_age_s:g} s old")
            return None

    @property
    def statistics(self) -> StreamStatistics:
        """What has arrived until now."""
        with self._changed:
            return replace(self._counts, rate_hz=self._meter.rate_hz(self._clock()))

    def _add(self, image: Image, counts: StreamStatistics) -> StreamStatistics:
        dropped = 0
        if self.drop == "oldest":
            while len(self._unread) >= self._parameters.unread:
                self._unread.popleft()
                dropped += 1
        elif not self._has_room():
            self._ended = True
            self._error = DeviceError(
                f"{self._name} sends images faster than they are read: {len(self._unread)} are "
                f"waiting; lower its rate or its resolution, or let drop='oldest' leave some out"
            )
            return replace(counts, dropped=counts.dropped + 1)
        self._unread.append(image)
        self._newest = image
        self._meter.add(image.timestamp_s)
        return replace(counts, dropped=counts.dropped + dropped)

    def _has_room(self) -> bool:
        if self.drop == "oldest":
            return len(self._unread) < self._parameters.unread
        waiting = sum(image.pixels.nbytes for image in self._unread)
        return not self._unread or waiting < self._parameters.never_bytes

    def _is_new(self, max_age_s: float) -> bool:
        newest = self._newest
        return newest is not None and newest.timestamp_s >= self._clock() - max_age_s

    def _raise_reason(self, missing: str) -> None:
        """Raise why there is no image, unless the stream ended without an error."""
        if not self._ended:
            torn = self._counts.torn
            raise CameraTimeout(
                f"{self._name} {missing}{f'; {torn} came torn' if torn else ''}; check its cable, "
                f"power and light, or allow more time"
            )
        if self._error is not None:
            # a new object each time: the traceback of one that is raised again grows
            raise copy(self._error) from self._error


def _equal(image: Image, other: Image) -> bool:
    if image.encoded is not None and other.encoded is not None:
        return image.encoded == other.encoded
    return np.array_equal(image.pixels, other.pixels)
