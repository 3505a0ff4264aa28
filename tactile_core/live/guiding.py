"""Guided calibration of a live sensor: leads the user, saves the bundle, and measures with it."""

from __future__ import annotations

from typing import Any

from tactile_core.calibration.guided.guidance import Guidance
from tactile_core.calibration.guided.session import GuidedCalibration
from tactile_core.errors import InputError, TactileError, words_of
from tactile_core.live.live_sensor import LiveSensor
from tactile_core.live.parameters import PAGE
from tactile_core.live.snapshot import new_path
from tactile_core.quantities import Frame
from tactile_core.recordings.running_recording import RunningRecording

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
        self._beginning = self._fitting = False
        self.report, self.problem, self._measured_with = b"", "", ""

    @property
    def state(self) -> str:
        """``""``, ``"beginning"``, ``"pressing"`` or ``"fitting"``."""
        if self._beginning or self._fitting:
            return "beginning" if self._beginning else "fitting"
        return "" if self._guided is None else "pressing"

    def begin(self, ball_diameter_mm: float | None, measured_with: str = "") -> str:
        """Take a reference, and begin to look at every frame.

        ``measured_with`` says how the ball and the scale were measured, for the bundle.

        Raises
        ------
        TactileError
            The ball is unknown or implausible, or the sensor shows a recording.
        """
        live, sensor = self._live, self._live.sensor
        if live.playback is not None:
            raise InputError("a recording is calibrated by 'tactile calibrate', not live")
        if self.state:
            raise InputError("a calibration is under way; finish or end it first")
        if not ball_diameter_mm:
            raise InputError(
                "give the diameter of the ball in mm, measured with a calliper: every height is "
                "in proportion to it"
            )
        self._beginning = True
        try:
            said = live.do(self._record).result()
            taken = live.do(lambda: sensor.capture_reference(PAGE.reference_frames))
            reference, recording = taken.result(), self._recording
            self._guided = GuidedCalibration(
                sensor.profile,
                reference,
                ball_diameter_mm,
                serial=sensor.serial or "",
                note=None if recording is None else recording.add_event,
            )
        except BaseException:
            self.close()
            raise
        finally:
            self._beginning = False
        self.problem, self._measured_with, live.guide = "", measured_with, self._fed
        return f"Reference taken. {said}"

    def finish(self) -> str:
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
            result = guided.finish().measured_with(self._measured_with)
            result.save(folder)
            self._live.do(lambda: self._live.sensor.use_bundle(result.bundle)).result()
        finally:
            self._fitting = False
        self.report = (folder / REPORT).read_bytes()
        self.close()
        return f"Calibrated; the bundle is in {folder}, and the sensor measures with it"

    def end(self) -> str:
        """End the session; what was not saved is lost, but its recording stays.

        Raises
        ------
        InputError
            It is being fitted.
        """
        if self._fitting:
            raise InputError("the calibration is being fitted; wait until it is saved")
        self.close()
        return "The calibration has ended"

    def close(self) -> None:
        """End the session, whatever it is doing; may be called from any thread, and twice."""
        self._live.guide = None
        guided, self._guided = self._guided, None
        if guided is not None:
            guided.close()
        recording, self._recording = self._recording, None
        if recording is not None:
            recording.close()

    def _fed(self, frame: Frame) -> Guidance | None:
        """Look at a frame; a failure ends the calibration, and the sensor goes on."""
        guided = self._guided
        try:
            return None if guided is None else guided.feed(frame)
        except Exception as error:
            known = isinstance(error, TactileError | OSError)
            why = str(error) if known else f"{words_of(error)} (this is a bug; please report it)"
            self.problem = f"The calibration has ended: {why}"
            self.close()
            return None

    def _record(self) -> str:
        path = new_path(self._live.out, self._live.sensor.name, "_calibration.mcap")
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._recording = self._live.sensor.record(path)
        except TactileError as error:
            return f"The session is not recorded: {error}."
        return f"The session is recorded in {path}"


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
