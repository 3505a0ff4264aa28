"""What can be done with one live sensor: the buttons of its part of the page."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from tactile_core.errors import InputError
from tactile_core.interfaces.simulator import Aim, Hand
from tactile_core.recordings.running_recording import RunningRecording
from tactile_live.commands import (
    AnyCommand,
    Calibrate,
    Finish,
    MoveCommand,
    Play,
    RecordCommand,
    Snapshot,
    TakeCommand,
    TakeReference,
    Tare,
)
from tactile_live.guiding import Guiding, described_guidance
from tactile_live.live_sensor import LiveSensor
from tactile_live.shown_state import new_path, save_snapshot

T = TypeVar("T")

# Objects for the hand, and their options for one size.
_OBJECTS: dict[str, Callable[[float], dict[str, Any]]] = {
    "sphere": lambda mm: {"diameter_mm": mm},
    "cylinder": lambda mm: {"diameter_mm": mm, "length_mm": 1.6 * mm},
    "flat": lambda mm: {"diameter_mm": mm},
    "cone": lambda mm: {"diameter_mm": mm},
    "coin": lambda mm: {"diameter_mm": mm},
    "screw": lambda mm: {"diameter_mm": mm},
}


class Desk:
    """Carries out the commands of pages that watch a sensor.

    One worker begins, ends and saves, one after the other, whichever page asked: what has begun is
    carried out to its end, and :meth:`status` shows it, also if its page leaves meanwhile.

    Parameters
    ----------
    live : LiveSensor
    """

    def __init__(self, live: LiveSensor) -> None:
        self.live = live
        self.shown_ms: deque[float] = deque(maxlen=300)  # [frames] ten seconds at 30 Hz
        self.guiding = Guiding(live)
        self._recording: RunningRecording | None = None
        self._worker = ThreadPoolExecutor(1, f"worker of {self.name}")
        self._fitter = ThreadPoolExecutor(1, f"fitter of {self.name}")  # one can record meanwhile

    @property
    def name(self) -> str:
        """The sensor's name."""
        return self.live.sensor.name

    def note_delay(self, ms: float) -> None:
        """Note the time from a frame to the screen."""
        self.shown_ms.append(ms)

    def describe_page(self, number: int = 0) -> dict[str, Any]:
        """Return what does not change, for the beginning of a page.

        Parameters
        ----------
        number : int
            Of the sensor on the page.
        """
        sensor = self.live.sensor
        image, hand = sensor.profile.image, self.live.hand
        return {
            "sensor": self.name,
            "profile": sensor.profile.name,
            "description": sensor.profile.description,
            "serial": sensor.serial,
            "kind": _kind(self.live),
            "number": number,
            "notes": list(sensor.notes),
            "size": [image.width_px, image.height_px],
            "mm_per_px": image.mm_per_px,
            "hand": None
            if hand is None
            else {"objects": list(_OBJECTS), "deepest_mm": hand.deepest_mm},
            "out": str(self.live.out),
            "status": self.status(),
        }

    def status(self) -> dict[str, Any]:
        """Return what the buttons show."""
        playback, hand, recording = self.live.playback, self.live.hand, self._recording
        return {
            "playback": None if playback is None else playback.state.describe_state(),
            "problem": "" if hand is None else hand.problem,
            "failure": self.live.failure or self.guiding.problem,
            "calibration": self.guiding.state,
            "report": bool(self.guiding.report),
            "guidance": described_guidance(self.live),
            "recording": None if recording is None else _describe_recording(recording),
        }

    @property
    def under_way(self) -> str:
        """What goes on if every page leaves: a recording, a calibration or nothing."""
        calibrates = "the calibration" if self.guiding.state else ""
        return "the recording" if self._recording is not None else calibrates

    async def do(self, command: AnyCommand) -> str:
        """Carry out a command, and return what was done, as a sentence.

        Raises
        ------
        TactileError, OSError
            It cannot be done; the message says why.
        """
        live = self.live
        match command:
            case MoveCommand():
                values = command.model_dump(exclude={"id", "do"})
                self._hand().aim(Aim(**values))
                return ""
            case TakeCommand():
                if command.kind not in _OBJECTS:
                    raise InputError(f"there is no object {command.kind!r}; choose from the list")
                self._hand().take(command.kind, _OBJECTS[command.kind](command.size_mm))
                return f"{command.kind} of {command.size_mm:g} mm"
            case TakeReference():
                taken = await self._done(live.do(lambda: live.take_reference(command.frames)))
                return f"Reference taken, the mean of {taken.frames} observations"
            case Tare():
                await self._done(live.do(live.sensor.tare))
                return "Tared: later readings are relative to this load"
            case Play():
                how = command.model_dump(exclude={"id", "do"})
                await self._done(live.do(lambda: live.play(**how)))
                return ""
            case Finish():
                return await self._done(self._fitter.submit(self.guiding.finish))
        return await self._done(self._worker.submit(self._work, command))

    def close(self) -> None:
        """End a recording, and close the sensor."""
        self.live.stop()
        self._worker.shutdown(cancel_futures=True)
        try:
            self.guiding.close()
            self._end_recording()
        finally:
            self._fitter.shutdown(cancel_futures=True)
            self.live.close()

    async def _done(self, work: Future[T]) -> T:
        """Wait for work, of which every page learns, also if the one that asked has left."""
        work.add_done_callback(lambda _: self.live.newest.again())
        return await asyncio.wrap_future(work)

    def _work(self, command: AnyCommand) -> str:
        match command:
            case Snapshot():
                return self._snapshot()
            case RecordCommand():
                return self._record(on=command.on)
            case Calibrate():
                if not command.on:
                    return self.guiding.end()
                return self.guiding.begin(command.ball_diameter_mm, command.measured_with)
        raise InputError("this command has nothing to do")

    def _hand(self) -> Hand:
        if self.live.hand is None:
            raise InputError(f"{self.name} is no virtual sensor, so there is no object to move")
        return self.live.hand

    def _snapshot(self) -> str:
        state = self.live.newest.value
        if state is None:
            raise InputError("there is no reading yet; wait for the first picture")
        pipeline = self.live.sensor.pipeline
        folder = save_snapshot(pipeline, state.reading, self.live.out, self.name)
        return f"Saved in {folder}"

    def _record(self, *, on: bool) -> str:
        if on and self._recording is None:
            path = new_path(self.live.out, self.name, ".mcap")
            # between two observations, as the recording begins with a whole one
            self._recording = self.live.do(lambda: self._begin_recording(path)).result()
            return f"Recording to {path}"
        if not on and self._recording is not None:
            return self._end_recording()
        return ""

    def _begin_recording(self, path: Path) -> RunningRecording:
        path.parent.mkdir(parents=True, exist_ok=True)
        return self.live.sensor.record(path)

    def _end_recording(self) -> str:
        recording, self._recording = self._recording, None
        if recording is None:
            return ""
        recording.close()
        if recording.failure:
            raise InputError(recording.failure)
        return f"Recorded {recording.images} images"


def _kind(live: LiveSensor) -> str:
    if live.hand is not None:
        return "virtual"
    return "live" if live.sensor.is_live else "recording"


def _describe_recording(recording: RunningRecording) -> dict[str, Any]:
    return {
        "images": recording.images,
        "dropped": recording.dropped,
        "bytes": recording.bytes,
        "failure": recording.failure or "",
    }
