"""Guided calibration of a live sensor: leads the user, saves the bundle, and measures with it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

from tactile_core.calibration.guided.guidance import Guidance
from tactile_core.calibration.guided.session import GuidedCalibration
from tactile_core.errors import InputError, TactileError, words_of
from tactile_core.live.live_sensor import LiveSensor
from tactile_core.live.parameters import PAGE
from tactile_core.live.snapshot import new_path
from tactile_core.quantities import Frame
from tactile_core.recordings.running_recording import RunningRecording

T = TypeVar("T")
Between = Callable[[Callable[[], T]], Awaitable[T]]

REPORT = "report.html"


class Guiding:
    """The calibration of one sensor, from its reference to its bundle.

    The session is recorded, so that it can be fitted again.

    Parameters
    ----------
    live : LiveSensor

    Attributes
    ----------
    report : bytes
        The report of the last calibration, as a page; empty before.
    problem : str
        Why the last calibration ended early, as a sentence; empty if it did not.
    """

    def __init__(self, live: LiveSensor) -> None:
        self._live = live
        self._recording: RunningRecording | None = None
        self._guided: GuidedCalibration | None = None
        self._fitting = False
        self.report, self.problem = b"", ""

    @property
    def state(self) -> str:
        """``""``, ``"pressing"`` or ``"fitting"``."""
        if self._fitting:
            return "fitting"
        return "" if self._guided is None else "pressing"

    async def begin(self, between: Between[Any], ball_diameter_mm: float) -> str:
        """Take a reference, and begin to look at every frame.

        Parameters
        ----------
        between : callable
            Calls a function between two observations.
        ball_diameter_mm : float

        Raises
        ------
        TactileError
            The ball is implausible, or the sensor shows a recording.
        """
        live, sensor = self._live, self._live.sensor
        if live.playback is not None:
            raise InputError("a recording is calibrated by 'tactile calibrate', not live")
        if self.state:
            raise InputError("a calibration is under way; finish or end it first")
        said = await between(self._record)
        reference = await between(lambda: sensor.capture_reference(PAGE.reference_frames))
        recording = self._recording
        try:
            self._guided = await asyncio.to_thread(
                GuidedCalibration,
                sensor.profile,
                reference,
                ball_diameter_mm,
                serial=sensor.serial or "",
                note=None if recording is None else recording.add_event,
            )
        except BaseException:
            self._end_recording()
            raise
        self.problem, live.guide = "", self._fed
        return f"Reference taken. {said}"

    async def finish(self, between: Between[Any]) -> str:
        """Fit what was kept, save the bundle, and measure with it from now on.

        Raises
        ------
        TactileError, OSError
            Too few presses, or the folder cannot be written to; the session goes on.
        """
        guided = self._guided
        if guided is None or self._fitting:
            raise InputError("no calibration is under way; begin one first")
        folder = new_path(self._live.out, self._live.sensor.name, "_bundle")
        self._fitting = True
        try:
            result = await asyncio.to_thread(guided.finish, folder)
            await between(lambda: self._live.sensor.use_bundle(result.bundle))
        finally:
            self._fitting = False
        self.report = (folder / REPORT).read_bytes()
        self.end()
        return f"Calibrated; the bundle is in {folder}, and the sensor measures with it"

    def end(self) -> str:
        """End the session; what was not saved is lost, but its recording stays."""
        self._live.guide = None
        guided, self._guided = self._guided, None
        if guided is not None:
            guided.close()
        self._end_recording()
        return "The calibration has ended"

    def _fed(self, frame: Frame) -> Guidance | None:
        """Look at a frame; a failure ends the calibration, and the sensor goes on."""
        guided = self._guided
        try:
            return None if guided is None else guided.feed(frame)
        except Exception as error:
            known = isinstance(error, TactileError | OSError)
            why = str(error) if known else f"{words_of(error)} (this is a bug; please report it)"
            self.problem = f"The calibration has ended: {why}"
            self.end()
            return None

    def _record(self) -> str:
        path = new_path(self._live.out, self._live.sensor.name, "_calibration.mcap")
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._recording = self._live.sensor.record(path)
        except TactileError as error:
            return f"The session is not recorded: {error}."
        return f"The session is recorded in {path}"

    def _end_recording(self) -> None:
        recording, self._recording = self._recording, None
        if recording is not None:
            recording.close()


def described_guidance(live: LiveSensor) -> dict[str, Any] | None:
    """Return what the page shows of a calibration, JSON-ready; None if none is under way."""
    guidance = live.guidance
    if guidance is None or live.guide is None:
        return None
    return {
        **guidance.summary(),
        "examining": guidance.examining,
        "imprint_px": guidance.imprint_px,
        "held_out_each": list(guidance.held_out_each),
        "coverage_map": _rows(guidance.coverage),
        "slope_map": _rows(guidance.slope_coverage),
    }


def _rows(values: Any) -> list[list[float]]:
    return [[round(float(value), 3) for value in row] for row in values]
