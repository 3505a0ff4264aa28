"""Guided calibration: leads a person from press to press until more do not help."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.start import START
from tactile_core.calibration.fitted_bundle import KEPT, WITHDRAWN
from tactile_core.calibration.fitting import calibrate_presses
from tactile_core.calibration.guided.background import (
    AtOnce,
    InProcess,
    TouchChange,
    UndeformedCells,
    naming_a_kill,
)
from tactile_core.calibration.guided.coverage import (
    COVERAGE,
    Coverage,
    Target,
    score_of,
    still_helps,
)
from tactile_core.calibration.guided.examination import TouchBench, Verdict
from tactile_core.calibration.guided.touch import TOUCH, Guidance, State, Still, Touches
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.result import Calibrated
from tactile_core.errors import CalibrationError, InputError
from tactile_core.interfaces.device import Closing
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference

Note = Callable[[str, Mapping[str, Any]], None]


class SESSION:
    """When guided calibration begins and ends. Nothing sets them from outside."""

    quiet_frames = 3  # [count] Frames without a touch before the first press: they show the noise
    most_presses = COVERAGE.presses  # [count] No more are asked for than cover the view


class GuidedCalibration(Closing):
    """Leads a person who presses a ball, and keeps the good presses.

    Use it in a ``with`` block, feed it every live frame, and call :meth:`finish` when it is done,
    or earlier.

    Parameters
    ----------
    profile : Profile, str or Path
    reference : Reference
        The undeformed sensor, as averaged.
    ball_diameter_mm : float
    model : str, optional
        ``plugin.name`` of a calibrator that replaces the profile's.
    serial, gel : str
        For the bundle.
    note : callable, optional
        Called with the name and the values of each event that a recording of the session should
        have: ``sensor.record(path).add_event``.
    at_once : bool
        Examine and score in the call of :meth:`feed` instead of beside it: for simulated time.

    Raises
    ------
    InputError, ProfileError, PluginError
        The ball is implausible, or profile, reference or calibrator cannot be used.
    """

    def __init__(
        self,
        profile: Profile | str | Path,
        reference: Reference,
        ball_diameter_mm: float,
        *,
        model: str | None = None,
        serial: str = "",
        gel: str = "",
        note: Note | None = None,
        at_once: bool = False,
    ) -> None:
        self.profile = profile if isinstance(profile, Profile) else load_profile(profile)
        self._reference, self._ball_mm = reference, ball_diameter_mm
        self._model, self._serial, self._gel = model, serial, gel
        self._note: Note = note or (lambda name, values: None)
        bench = TouchBench.for_sensor(self.profile, reference, ball_diameter_mm, model)
        if reference.pixels.shape[:2] != (
            self.profile.image.height_px,
            self.profile.image.width_px,
        ):
            raise InputError("the reference has another size than the profile's images")
        self._background = AtOnce(bench) if at_once else InProcess(bench)
        self._cells = UndeformedCells(reference, bench.ball_radius_px)
        self._touches = Touches(bench.ball_radius_px)
        size = self.profile.image.width_px, self.profile.image.height_px
        self._coverage = Coverage(size, bench.touching_px)
        self._frames: dict[str, Frame] = {}
        self._circles: dict[str, Circle] = {}
        self._examined: deque[tuple[Frame, Future[Verdict]]] = deque()
        self._scored: deque[Future[float | None]] = deque()
        self._errors_deg: list[float] = []
        self._missed: list[Target] = []
        self._circle: Circle | None = None
        self._refused: str | None = None
        self._quiet = self._attempts = self._count = 0
        self._warning: str | None = None
        self._target = self._coverage.target(())
        self._maps = self._measure_coverage()

    def close(self) -> None:
        """End the work in the background; may be called twice."""
        self._background.close()

    @property
    def presses(self) -> Mapping[str, Frame]:
        """The frames that are kept, by name, as they were acquired."""
        return {name: self._frames[name] for name in self._circles}

    def feed(self, frame: Frame) -> Guidance:
        """Look at the next live frame, and say what to do.

        Takes a few milliseconds, unless ``at_once``.

        Raises
        ------
        InputError
            The frame does not match the reference.
        ChildProcessError
            A process that judges presses was killed.
        """
        change = self._cells.change(frame)
        self._collect()
        still = self._touches.add(frame, change)
        if not self._touches.touching:
            self._quiet += 1
            self._warning = _light_warning(change)
        if self._touches.ended_restless:
            self._attempts += 1
            self._refuse("the ball was never still; press, and hold it still until I say 'lift'")
        if still is not None and self._quiet >= SESSION.quiet_frames and not self._enough:
            self._judge(still)
            self._collect()
        return self._guidance(change)

    def wait(self) -> None:
        """Wait for what is being examined: where frames come faster than in real time."""
        wait([future for _, future in self._examined])
        self._collect()

    @naming_a_kill()
    def finish(self, *, scored: bool = True) -> Calibrated:
        """Fit and score all presses that are kept, as ``tactile calibrate`` does.

        Parameters
        ----------
        scored : bool
            False skips the cross-validation.

        Raises
        ------
        CalibrationError
            No press is kept, or none can be used.
        """
        if not self._circles:
            raise CalibrationError("no press was kept, so there is nothing to calibrate on")
        return self._background.run(
            _fit_presses,
            self.profile,
            dict(self.presses),
            self._reference,
            self._ball_mm,
            (self._model, self._serial, self._gel, scored),
        )

    @naming_a_kill()
    def _judge(self, still: Still) -> None:
        """Examine a press that held still, unless it is plain already that it is bad."""
        self._attempts += 1
        self._refused = None
        if still.slid_balls > TOUCH.slide_balls:
            self._refuse("the ball slid over the gel; press straight down")
            return
        if not self._coverage.is_new(still.middle_px, list(self._circles.values())):
            self._refuse("this place was pressed before; press at the ring")
            return
        self._count += 1
        name = f"press_{self._count:02d}"
        self._examined.append((still.frame, self._background.examine(name, still.frame)))

    @naming_a_kill()
    def _collect(self) -> None:
        """Take up what the background has finished."""
        while self._examined and self._examined[0][1].done():
            frame, future = self._examined.popleft()
            self._take_up(frame, future.result())
        while self._scored and self._scored[0].done():
            error_deg = self._scored.popleft().result()
            if error_deg is not None:
                self._errors_deg.append(error_deg)

    def _take_up(self, frame: Frame, verdict: Verdict) -> None:
        self._circle = verdict.circle
        if verdict.why:
            self._refuse(verdict.why)
            return
        name = verdict.name
        self._frames[name] = frame
        self._scored.append(self._background.score(name))
        self._note(KEPT, self._event(name, frame))
        for gone, why in verdict.withdrawn.items():
            self._note(WITHDRAWN, {**self._event(gone, self._frames.pop(gone)), "why": why})
        self._circles = dict(verdict.circles)
        self._refused = None
        self._missed.clear()
        self._target = self._coverage.target(list(self._circles.values()))
        self._maps = self._measure_coverage()

    def _refuse(self, why: str) -> None:
        self._refused = why
        # a place where presses fail, such as a damaged one, must not be asked for again and again
        self._missed.append(self._target)
        if len(self._missed) % 2 == 0:
            self._target = self._coverage.target(list(self._circles.values()), self._missed)

    def _event(self, name: str, frame: Frame) -> dict[str, Any]:
        """Values of an event; the time stamp finds the frame in the recording."""
        return {
            "name": name,
            "timestamp_s": frame.timestamp_s,
            "ball_diameter_mm": self._ball_mm,
        }

    def _measure_coverage(self) -> tuple[np.ndarray, np.ndarray]:
        kept = list(self._circles.values())
        return self._coverage.surface(kept), self._coverage.slopes(kept)

    @property
    def _enough(self) -> bool:
        """Whether no further press is examined: what is being examined counts as kept."""
        kept = len(self._circles)
        if kept + len(self._examined) >= SESSION.most_presses:
            return True
        # [count] Fewest presses with which guiding ends by itself. Source: the circle search
        # describes the light best from 12 on (``LIGHT``).
        if kept < 12:
            return False
        # [count] Nor after this many touches, if so many are kept. Source: the same.
        if self._attempts >= 30:
            return True
        complete = self._coverage.is_complete(list(self._circles.values()))
        return complete and not still_helps(self._errors_deg)

    def _guidance(self, change: TouchChange) -> Guidance:
        done, touching = self._enough and not self._examined, self._touches.touching
        state, say = self._advice(done=done)
        x, y = change.middle_px
        return Guidance(
            say=say,
            state=state,
            target_px=None if done or state == "hands_off" else self._target.centre_px,
            target_radius_px=self._target.contact_radius_px,
            imprint_px=(float(x), float(y)) if touching else None,
            circle=self._circle,
            kept=len(self._circles),
            attempts=self._attempts,
            refused=self._refused,
            examining=bool(self._examined),
            coverage=self._maps[0],
            slope_coverage=self._maps[1],
            held_out=score_of(self._errors_deg),
            held_out_each=tuple(self._errors_deg),
            warning=self._warning,
            done=done,
        )

    def _advice(self, *, done: bool) -> tuple[State, str]:
        kept = len(self._circles)
        if done:
            return "done", f"{kept} presses are kept; more would not help."
        if self._quiet < SESSION.quiet_frames:
            return "hands_off", "Keep your hands off the gel."
        if self._touches.since_still:
            if self._refused:
                return "lift", f"Not kept: {self._refused}. Lift the ball."
            return "lift", "Lift the ball." if self._examined else "Kept. Lift the ball."
        if self._enough:
            return "lift", "Lift the ball: the last press is being examined."
        if self._touches.touching:
            return "hold", "Press until the imprint fills the ring, and hold still."
        before = f"Not kept: {self._refused}. " if self._refused else ""
        return "press", f"{before}Press the ball at the ring, and hold it still."


def _fit_presses(
    profile: Profile,
    presses: Mapping[str, Frame],
    reference: Reference,
    ball_diameter_mm: float,
    chosen: tuple[str | None, str, str, bool],
) -> Calibrated:
    """Fit presses; without the analysis of each, which would only be sent between processes."""
    model, serial, gel, scored = chosen
    result = calibrate_presses(
        profile,
        presses,
        reference,
        ball_diameter_mm=ball_diameter_mm,
        model=model,
        serial=serial,
        gel=gel,
        scored=scored,
    )
    light = [
        replace(press, start=None) if isinstance(press, FoundPress) else press
        for press in result.presses
    ]
    return replace(result, presses=tuple(light))


def _light_warning(change: TouchChange) -> str | None:
    largest = float(np.abs(change.light).max())
    if largest <= START.largest_drift:
        return None
    return (
        f"the light has changed by {np.expm1(largest):.0%} since the reference; let it warm up, "
        f"and begin again with a new reference"
    )
