"""A sensor that measures in a thread of its own, for pages that come and go."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from tactile_core.acquisition.free_running import HOST
from tactile_core.calibration.guided.touch import Guidance
from tactile_core.errors import DeviceError, InputError, TactileError, words_of
from tactile_core.interfaces.simulator import Hand, HandCamera
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.sensor import Sensor
from tactile_core.quantities import Frame, Reference
from tactile_live.numbers import Entry, entries_of
from tactile_live.opening import ShownPlayback
from tactile_live.pictures import Newest


@dataclass(frozen=True, eq=False)
class LiveState:
    """What there is to show of a sensor after one observation.

    Attributes
    ----------
    number : int
        Counts the observations of this session.
    reading : Reading
    frame : Frame
        As the camera sent it.
    taken_s : float
        Host time at mid-observation; of a recording, when it was played.
    entries : tuple of Entry
        Numbers and words of the reading.
    faults : tuple of str
        What could not be read from it.
    rate_hz : float
        Observations a second.
    health : mapping
        As of ``tactile doctor --watch --json``.
    failure : str
        Why there is no newer observation; empty if all is well.
    """

    number: int
    reading: Reading
    frame: Frame
    taken_s: float
    entries: tuple[Entry, ...]
    faults: tuple[str, ...]
    rate_hz: float
    health: dict[str, Any]
    failure: str = ""


@dataclass(frozen=True)
class Sample:
    """The numbers of one observation, for the plots."""

    number: int
    taken_s: float
    values: dict[str, float]


T = TypeVar("T")


class LiveSensor:
    """Reads a sensor in a thread of its own; nobody who looks on can delay it.

    Parameters
    ----------
    sensor : Sensor
        Open; closed by :meth:`close`.
    out : Path
        Folder for snapshots and recordings.

    Attributes
    ----------
    newest : Newest of LiveState
    is_needed : callable
        Says whether somebody looks or something is under way; else a virtual sensor waits.
    guide : callable or None
        Looks at each frame while the sensor is calibrated, and says what to do.
    """

    def __init__(self, sensor: Sensor, out: Path) -> None:
        self.sensor, self.out = sensor, out
        self.newest: Newest[LiveState] = Newest()
        camera = sensor.camera
        self._virtual = camera if isinstance(camera, HandCamera) else None
        paced = not sensor.is_live and self._virtual is None
        self.playback = ShownPlayback() if paced else None
        self.failure = ""
        self.is_needed: Callable[[], bool] = lambda: True
        self.guide: Callable[[Frame], Guidance | None] | None = None
        self.guidance: Guidance | None = None
        self._samples: deque[Sample] = deque()
        self._work: queue.Queue[tuple[Future[Any], Callable[[], Any]]] = queue.Queue()
        self._stopping = threading.Event()
        self._number, self._rate_hz, self._last_s = 0, 0.0, 0.0
        self._health: tuple[float, dict[str, Any]] = (float("-inf"), {})
        self._thread = threading.Thread(target=self._run, name=f"live {sensor.name}", daemon=True)

    @property
    def hand(self) -> Hand | None:
        """The hand that moves an object on a virtual sensor; None for other sensors."""
        return None if self._virtual is None else self._virtual.hand

    def start(self) -> LiveSensor:
        """Begin to measure."""
        self._thread.start()
        return self

    def stop(self) -> None:
        """End measuring; what still waits to be done is refused."""
        self._stopping.set()
        self.do(lambda: None)  # wakes the thread
        if self._thread.is_alive():
            self._thread.join(5.0)

    def close(self) -> None:
        """End measuring, and close the sensor."""
        self.stop()
        self.sensor.close()

    def do(self, work: Callable[[], T]) -> Future[T]:
        """Call a function between two observations, in the thread that measures.

        While the devices are lost, and from the end on, it is refused instead.
        """
        future: Future[T] = Future()
        self._work.put((future, work))
        if self._stopping.is_set():
            self._refuse_all("the sensor is being closed")
        return future

    def samples_between(self, after: int, last: int) -> list[Sample]:
        """Return the numbers of the observations after one, to the last, as far as kept."""
        while True:
            with suppress(RuntimeError):  # the other thread has added one meanwhile
                return [one for one in self._samples if after < one.number <= last]

    def play(self, **how: Any) -> None:
        """Change how a recording is played; as :meth:`ShownPlayback.play`.

        Raises
        ------
        InputError
            The sensor shows no recording.
        """
        if self.playback is None:
            raise InputError(f"{self.sensor.name} plays no recording, so it cannot be paused")
        if self.playback.play(**how):
            self._rewind()

    def take_reference(self, frames: int) -> Reference:
        """Use the mean of the next observations as the reference.

        A recording that loops begins again if it is at its end.

        Raises
        ------
        InputError
            No observation is left.
        """
        try:
            return self.sensor.capture_reference(frames)
        except InputError:
            if self.playback is None or not self.playback.end():
                raise
        self._rewind()
        return self.sensor.capture_reference(frames)

    def _rewind(self) -> None:
        self.sensor.rewind()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._do_all()
                if self.playback is not None and self.playback.waits:
                    self._do_one(timeout_s=1.0)
                elif self._virtual is not None and self._number and not self.is_needed():
                    self._last_s = 0.0  # the pause is no part of the rate
                    self._do_one(timeout_s=0.1)
                else:
                    self._observe()
            except DeviceError as error:
                self._fail(str(error))
                self._reopen()
            except TactileError as error:
                self._fail(str(error))
                self._do_one(timeout_s=0.2)
            except Exception as error:
                self._fail(f"{words_of(error)} (this is a bug; please report it)")
                self._do_one(timeout_s=0.2)

    def _observe(self) -> None:
        frame = self.sensor.acquire()
        if frame is None:
            if self.playback is not None and self.playback.end() and self._number:
                self._rewind()
            else:
                self.newest.again()  # says that it has ended
            return
        if self.playback is not None:
            self._wait(frame.timestamp_s)
        shown_s = frame.timestamp_s if self.playback is None else HOST.now()
        reading = self.sensor.measure(frame)
        if self.playback is not None:
            self.playback.note_observation()
        guide = self.guide
        self.guidance = None if guide is None else guide(frame)
        self._show(frame, reading, shown_s)

    def _wait(self, timestamp_s: float) -> None:
        """Wait until an observation of a recording is due, and do meanwhile what is asked for."""
        playback = self.playback
        assert playback is not None
        while not self._stopping.is_set():
            left_s = playback.wait_s(timestamp_s, HOST.now())
            if left_s <= 0:
                return
            self._do_one(timeout_s=left_s)

    def _show(self, frame: Frame, reading: Reading, taken_s: float) -> None:
        now_s = HOST.now()
        self._number += 1
        if self._last_s:
            rate_hz = 1 / max(now_s - self._last_s, 1e-6)
            past = 0.9 if self._rate_hz else 0.0  # weight of the past
            self._rate_hz = 1 / (past / (self._rate_hz or 1.0) + (1 - past) / rate_hz)
        self._last_s = now_s
        if now_s - self._health[0] > 0.5:
            self._health = (now_s, self.sensor.health().summary())
        entries, faults = entries_of(reading)
        values = {entry.key: float(entry.value) for entry in entries if entry.is_number}
        values["latency_ms"] = reading.latency_ms
        self._samples.append(Sample(self._number, taken_s, values))
        while self._samples[0].taken_s < taken_s - 30.0:
            self._samples.popleft()
        self.failure = ""
        self.newest.put(
            LiveState(
                number=self._number,
                reading=reading,
                frame=frame,
                taken_s=taken_s,
                entries=tuple(entries),
                faults=tuple(faults),
                rate_hz=self._rate_hz,
                health=self._health[1],
            )
        )

    def _fail(self, sentence: str) -> None:
        self.failure = sentence
        if self.newest.value is not None:
            self.newest.put(replace(self.newest.value, failure=sentence))

    def _reopen(self) -> None:
        """Close and open the devices until they are there; the sentence says why they are not.

        The reference stays; a tare is lost.
        """
        reference = self.sensor.pipeline.reference
        while not self._stopping.is_set():
            with suppress(TactileError):
                self.sensor.close()
            try:
                self.sensor.open()
            except TactileError as error:
                self._fail(str(error))
                self._refuse_all(str(error))
                self._stopping.wait(2.0)  # [s] between two attempts to open lost devices
            else:
                if reference is not None:
                    self.sensor.use_reference(reference)
                return

    def _do_all(self) -> None:
        while not self._work.empty():
            self._do_one(timeout_s=0.0)

    def _do_one(self, *, timeout_s: float) -> None:
        with suppress(queue.Empty):
            got = self._work.get(timeout=timeout_s) if timeout_s else self._work.get_nowait()
            future, work = got
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(work())
                except Exception as error:
                    future.set_exception(error)

    def _refuse_all(self, why: str) -> None:
        """Refuse what waits: nobody who asked waits for a device that may never come back."""
        with suppress(queue.Empty):
            while True:
                future, _ = self._work.get_nowait()
                if future.set_running_or_notify_cancel():
                    future.set_exception(DeviceError(why))
