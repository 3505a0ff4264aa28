"""The queue of unread images between a reader thread and the program that measures them."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from threading import Condition
from typing import NamedTuple

import numpy as np

from tactile_core.errors import CameraTimeout, DeviceError
from tactile_core.interfaces.camera import Drop, RateMeter, StreamStatistics
from tactile_core.interfaces.streaming.encoded_image import EncodedImage, TornImage
from tactile_core.quantities import Image

Tap = Callable[[Image | EncodedImage], None]  # Receives images that a camera sends, as it sent them


class QueueParameters(NamedTuple):
    """Sizes of a queue of images.

    Attributes
    ----------
    unread : int, images
        Unread images that are kept when the oldest is dropped. Source: a program that measures
        more slowly than the camera sends then reads images that are at most one frame period old.
    never_bytes : int, bytes
        Unread images that are kept when none is dropped, compressed if they came so. Source: 500
        uncompressed images of 640 × 480 pixels in colour, a pause of 15 s at 30 Hz, which fits
        into the memory of a small computer.
    window_s : float, s
        Time over which the rate is measured. Source: 60 images at 30 Hz, so that one image more or
        less changes the rate by less than 2 %.
    """

    unread: int = 1
    never_bytes: int = 460_800_000
    window_s: float = 2.0


class ImageQueue:
    """Images that a reader has put and nobody has read, and statistics of all that came.

    Compressed images are decoded when they are read, by the thread that reads.

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
    taps : sequence of callable
        As :meth:`add_tap` adds them.
    """

    def __init__(
        self,
        name: str,
        drop: Drop = "oldest",
        parameters: QueueParameters = QueueParameters(),  # noqa: B008
        clock: Callable[[], float] = time.monotonic,
        taps: Sequence[Tap] = (),
    ) -> None:
        self._taps = tuple(taps)
        self.drop = drop
        self._name, self._parameters, self._clock = name, parameters, clock
        self._changed = Condition()
        self._unread: deque[Image | EncodedImage] = deque()
        self._unread_bytes = 0
        self._before: Image | EncodedImage | None = None
        self._newest: Image | EncodedImage | None = None
        self._ended = False
        self._error: BaseException | None = None
        self._counts = StreamStatistics()
        self._meter = RateMeter(parameters.window_s)

    def has_room(self) -> bool:
        """Return whether another image fits without dropping one."""
        with self._changed:
            return self._has_room()

    def put(self, image: Image | EncodedImage) -> bool:
        """Add the camera's next image; return whether the stream goes on.

        The queue numbers the images. If none may be dropped and there is no room, the stream ends
        with an error: a gap that nobody notices would be worse.
        """
        with self._changed:
            if self._ended:
                return False
            before, counts = self._before, self._counts
            again = before is not None and image.timestamp_s <= before.timestamp_s
            if again or (before is not None and _equal(image, before)):
                counts = replace(counts, repeated=counts.repeated + 1)
            if not again:
                image = replace(image, sequence=counts.received + counts.torn)
                for tap in self._taps:
                    tap(image)
                counts = replace(counts, received=counts.received + 1)
                counts = self._add(image, counts)
            self._counts = counts
            self._changed.notify_all()
            return not self._ended

    def add_tap(self, tap: Tap) -> None:
        """Pass each image on as it arrives, also those that will be dropped; unread ones at once.

        Parameters
        ----------
        tap : callable
            Called in the reader's thread; it must return at once and never raise.
        """
        with self._changed:
            for image in self._unread:
                tap(image)
            self._taps = (*self._taps, tap)

    def remove_tap(self, tap: Tap) -> None:
        """Pass no more images on to it."""
        with self._changed:
            self._taps = tuple(one for one in self._taps if one != tap)

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
        until_s = time.monotonic() + timeout_s
        while True:
            with self._changed:
                left_s = max(0.0, until_s - time.monotonic())
                self._changed.wait_for(lambda: self._unread or self._ended, left_s)
                if not self._unread:
                    self._raise_reason(f"sent no image within {timeout_s:g} s")
                    return None
                taken = self._take()
            image = self._decode_image(taken)
            if image is not None:
                return image

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
        until_s = time.monotonic() + max_age_s
        while True:
            with self._changed:
                left_s = max(0.0, until_s - time.monotonic())
                self._changed.wait_for(lambda: self._is_new(max_age_s) or self._ended, left_s)
                newest = self._newest
                if newest is None or not self._is_new(max_age_s):
                    self._raise_reason(f"has no image that is at most {max_age_s:g} s old")
                    return None
            image = self._decode_image(newest)
            if image is not None:
                return image

    @property
    def statistics(self) -> StreamStatistics:
        """What has arrived until now."""
        with self._changed:
            return replace(self._counts, rate_hz=self._meter.rate_hz(self._clock()))

    def _decode_image(self, image: Image | EncodedImage) -> Image | None:
        """Return an image with its pixels; count it as torn and return None if it has none."""
        if isinstance(image, Image):
            return image
        try:
            decoded = image.decode_pixels()
        except TornImage:
            decoded = None
        with self._changed:
            if self._newest is image:
                self._newest = decoded
            if decoded is None:
                if self._unread and self._unread[-1] is image:
                    self._unread.pop()  # seen as the latest, and not to be counted again
                    self._unread_bytes -= _bytes_of(image)
                counts = self._counts
                self._counts = replace(counts, received=counts.received - 1, torn=counts.torn + 1)
        return decoded

    def _take(self) -> Image | EncodedImage:
        image = self._unread.popleft()
        self._unread_bytes -= _bytes_of(image)
        return image

    def _add(self, image: Image | EncodedImage, counts: StreamStatistics) -> StreamStatistics:
        dropped = 0
        if self.drop == "oldest":
            while len(self._unread) >= self._parameters.unread:
                self._take()
                dropped += 1
        elif not self._has_room():
            self._ended = True
            self._error = DeviceError(
                f"{self._name} sends images faster than they are read: {len(self._unread)} are "
                f"waiting; lower its rate or its resolution, or let drop='oldest' leave some out"
            )
            return replace(counts, dropped=counts.dropped + 1)
        self._unread.append(image)
        self._unread_bytes += _bytes_of(image)
        self._before = self._newest = image
        self._meter.add(image.timestamp_s)
        return replace(counts, dropped=counts.dropped + dropped)

    def _has_room(self) -> bool:
        if self.drop == "oldest":
            return len(self._unread) < self._parameters.unread
        return not self._unread or self._unread_bytes < self._parameters.never_bytes

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


def _bytes_of(image: Image | EncodedImage) -> int:
    return image.pixels.nbytes if isinstance(image, Image) else image.nbytes


def _equal(image: Image | EncodedImage, other: Image | EncodedImage) -> bool:
    if isinstance(image, Image) and isinstance(other, Image) and image.encoded is None:
        return np.array_equal(image.pixels, other.pixels)
    return image.encoded == other.encoded
