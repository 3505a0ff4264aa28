"""A recording that is being written, by a thread of its own that the sensor never waits for."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from threading import Condition, Thread
from typing import Any, NamedTuple

from tactile_core.errors import words_of
from tactile_core.interfaces.device import Closing
from tactile_core.interfaces.recording_writer import RecordedImage, RecordedSession, RecordingWriter
from tactile_core.interfaces.sink import Reading
from tactile_core.interfaces.streaming.encoded_image import EncodedImage
from tactile_core.quantities import Frame, Image, Quantity, Reference
from tactile_core.quantities.array_form import size_change


class RecordingParameters(NamedTuple):
    """Limits of a recording that is being written.

    Attributes
    ----------
    queue_bytes : int, bytes
        Images and readings that wait for the disk. Source: 280 uncompressed images of 640 × 480
        pixels in colour, a pause of the disk of more than a second at 200 Hz, which fits into the
        memory of a small computer.
    check_s : float, s
        Time between two checks that the file was not deleted. Source: half a second seems
        immediate.
    close_s : float, s
        Longest wait for the disk when a recording is closed. Source: a full queue at 10 MB/s, the
        speed of a slow memory card.
    numbered : int, images
        Images of which the number is remembered until they are measured. Source: a pause of 15 s
        at 60 Hz.
    """

    queue_bytes: int = 256_000_000
    check_s: float = 0.5
    close_s: float = 30.0
    numbered: int = 1000


class RunningRecording(Closing):
    """Takes what a sensor's threads give it, and writes it in a thread of its own.

    Nothing that goes wrong here reaches the sensor: if the disk is full or too slow, images are
    left out and counted, or the recording ends and :attr:`failure` says why.

    Parameters
    ----------
    writer : RecordingWriter
        Belongs to the recording from now on.
    session : RecordedSession
    readings : bool
        Whether readings are written, too.
    waits : bool
        Whether images and readings wait for a slow disk, and are never left out.

    Raises
    ------
    InputError, OSError
        The file cannot be created.

    Attributes
    ----------
    images : int
        Images written.
    dropped, dropped_readings : int
        Images and readings left out because the disk was too slow.
    bytes : int
        Size of the images written, as the camera sent them.
    limit : int or None
        Images of a streaming camera from which on no more are taken.
    failure : str or None
        A sentence that says why the recording ended early.
    """

    def __init__(
        self,
        writer: RecordingWriter,
        session: RecordedSession,
        *,
        readings: bool = False,
        waits: bool = False,
        parameters: RecordingParameters = RecordingParameters(),  # noqa: B008
    ) -> None:
        self.images, self.dropped, self.dropped_readings, self.bytes = 0, 0, 0, 0
        self.failure: str | None = None
        self.limit: int | None = None
        self.readings = readings
        self._waits = waits
        self._writer, self._parameters = writer, parameters
        self._changed = Condition()
        self._waiting: deque[tuple[int, Callable[[], None]]] = deque()
        self._waiting_bytes = 0
        self._closing = False
        self._number = 0
        self._numbers: dict[float, int] = {}
        self._references = 0
        self._latest = -1
        self._first: int | None = None
        self._size_px: tuple[int, int] | None = None
        writer.open(session)
        name = f"writer of {writer.path.name}"
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def is_closed(self) -> bool:
        """Whether :meth:`close` was called."""
        return self._closing

    def add_image(self, image: Image | EncodedImage, levels: Mapping[str, float]) -> None:
        """Record an image of a streaming camera."""
        with self._changed:
            if self.limit is not None and self._number >= self.limit:
                return
            number = self._next_number()
            self._numbers[image.timestamp_s] = number
            if len(self._numbers) > self._parameters.numbered:
                del self._numbers[next(iter(self._numbers))]
            self._put_image(RecordedImage(image, number, levels=levels))

    def add_observation(
        self, frame: Frame, images: tuple[Image, ...], levels: tuple[Mapping[str, float], ...]
    ) -> None:
        """Record the exposures of an observation, all or none of them."""
        with self._changed:
            recorded = [
                RecordedImage(image, self._next_number(), frame.sequence, index, shining)
                for index, (image, shining) in enumerate(zip(images, levels, strict=True))
            ]
            nbytes = sum(one.nbytes for one in recorded)
            self._latest = frame.sequence
            self._first = frame.sequence if self._first is None else self._first
            if self._fits(nbytes):
                for one in recorded:
                    self._put_image(one, checked=True)
            else:
                self.dropped += len(recorded)

    def knows(self, frame: Frame, *, streamed: bool) -> bool:
        """Whether the images of a frame were recorded."""
        with self._changed:
            if streamed:
                return frame.timestamp_s in self._numbers
            return self._first is not None and self._first <= frame.sequence <= self._latest

    def add_measured(self, frame: Frame, *, tare: bool, streamed: bool) -> None:
        """Record that a frame is measured, and whether its load is subtracted from then on."""
        with self._changed:
            values: dict[str, Any] = {"tare": tare}
            if streamed:
                values["number"] = self._numbers.get(frame.timestamp_s)
            else:
                values["observation"] = frame.sequence
        self.add_event("measured", values)

    def add_event(self, name: str, values: Mapping[str, Any]) -> None:
        """Record an event with JSON-ready values."""
        content = dict(values)
        with self._changed:
            self._put(0, lambda: self._writer.write_event(name, content))

    def add_reference(self, reference: Reference) -> None:
        """Record a new reference."""
        with self._changed:
            self._references += 1
            name = f"{self._references:04d}"
            nbytes = reference.pixels.nbytes
            self._put(nbytes, lambda: self._writer.write_reference(name, reference))
            self._put(0, lambda: self._writer.write_event("reference", {"name": name}))

    def add_reading(self, reading: Reading) -> None:
        """Record the quantities of a reading, if that was asked for and the disk keeps up."""
        if not self.readings:
            return
        nbytes = sum(_bytes_of(quantity) for quantity in reading.quantities.values())
        with self._changed:
            if self._fits(nbytes):
                self._put(nbytes, lambda: self._writer.write_reading(reading))
            elif not self._closing and self.failure is None:
                self.dropped_readings += 1

    def left_out(self) -> str:
        """Say what was left out because the disk was too slow; empty if nothing was."""
        counts = {"images": self.dropped, "readings": self.dropped_readings}
        words = " and ".join(f"{count} {name}" for name, count in counts.items() if count)
        if not words:
            return ""
        return (
            f"{words} were left out of {self._writer.path}, because the disk was too slow; record "
            f"on a faster one"
        )

    def close(self) -> None:
        """Write what waits, complete the file and close it; may be called twice."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(self._parameters.close_s)
        if self._thread.is_alive() and self.failure is None:
            self.failure = (
                f"the recording {self._writer.path} cannot be completed, because the disk does "
                f"not answer; 'tactile recover' reads what was written"
            )

    def _next_number(self) -> int:
        number, self._number = self._number, self._number + 1
        return number

    def _fits(self, nbytes: int) -> bool:
        if self._waits:
            self._changed.wait_for(lambda: self.failure is not None or self._has_room(nbytes))
        return self._has_room(nbytes)

    def _has_room(self, nbytes: int) -> bool:
        return not self._waiting or self._waiting_bytes + nbytes <= self._parameters.queue_bytes

    def _put_image(self, recorded: RecordedImage, *, checked: bool = False) -> None:
        self._size_px = self._size_px or recorded.size_px
        if self._size_px and recorded.size_px and self._size_px != recorded.size_px:
            # what came before is written; a recording of two sizes could not be played
            change = size_change(self._size_px, recorded.size_px)
            self.failure = self.failure or f"the recording {self._writer.path} has ended: {change}"

        def write() -> None:
            self._writer.write_image(recorded)
            self.images += 1
            self.bytes += recorded.nbytes

        if checked or self._fits(recorded.nbytes):
            self._put(recorded.nbytes, write)
        elif not self._closing and self.failure is None:
            self.dropped += 1

    def _put(self, nbytes: int, write: Callable[[], None]) -> None:
        if self._closing or self.failure is not None:
            return
        self._waiting.append((nbytes, write))
        self._waiting_bytes += nbytes
        self._changed.notify_all()

    def _run(self) -> None:
        try:
            self._write_all()
        except Exception as error:
            self._fail(error)
        try:
            self._writer.close()
        except Exception as error:
            self._fail(error)

    def _write_all(self) -> None:
        check_at_s = time.monotonic() + self._parameters.check_s
        while True:
            with self._changed:
                if not self._waiting and not self._closing:
                    self._changed.wait(max(0.0, check_at_s - time.monotonic()))
                if not self._waiting and self._closing:
                    return
                nbytes, write = self._waiting.popleft() if self._waiting else (0, None)
            if write is not None:
                write()
                with self._changed:
                    self._waiting_bytes -= nbytes
                    self._changed.notify_all()
            if time.monotonic() >= check_at_s:
                self._writer.check()
                check_at_s = time.monotonic() + self._parameters.check_s

    def _fail(self, error: Exception) -> None:
        """End the recording; what was written stays."""
        with self._changed:
            if self.failure is None:
                reason = getattr(error, "strerror", None) or words_of(error)
                self.failure = (
                    f"the recording {self._writer.path} ended after {self.images} images "
                    f"({reason}); free the disk or name another place, and record again"
                )
            self._waiting.clear()
            self._waiting_bytes = 0
            self._changed.notify_all()


def _bytes_of(quantity: Quantity) -> int:
    arrays = (getattr(quantity, name) for name in quantity.__dataclass_fields__)
    return sum(int(getattr(array, "nbytes", 0)) for array in arrays)
