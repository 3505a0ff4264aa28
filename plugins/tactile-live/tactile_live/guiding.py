"""Guided calibration on the page, and who may lead it."""

from __future__ import annotations

import ipaddress
import os
import re
import secrets
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactile_core.calibration.guided.session import GuidedCalibration
from tactile_core.calibration.guided.touch import Guidance
from tactile_core.errors import InputError, TactileError, words_of
from tactile_core.quantities import Frame
from tactile_core.recordings.running_recording import RunningRecording
from tactile_live.commands import REFERENCE_FRAMES
from tactile_live.live_sensor import LiveSensor
from tactile_live.shown_state import new_path

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
            taken = live.do(lambda: sensor.capture_reference(REFERENCE_FRAMES))
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
        self.problem, self._measured_with, live.guide = "", measured_with, self._feed_frame
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

    def _feed_frame(self, frame: Frame) -> Guidance | None:
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


_TOKEN = re.compile(r"[A-Za-z0-9_-]{43}")


@dataclass(frozen=True)
class Gate:
    """Lets requests in that know the token and come from the page itself.

    Browsers name the page that a request comes from (``Origin``) and the host that its user
    believes to speak with (``Host``). A foreign page cannot forge either: checked together, they
    keep out other sites, and those whose name was pointed to this machine (DNS rebinding).

    Attributes
    ----------
    token : str
        First part of every path.
    hosts : frozenset of str
        Values of ``Host`` that are this server.
    """

    token: str
    hosts: frozenset[str]

    @classmethod
    def for_port(cls, token: str, port: int, names: Iterable[str]) -> Gate:
        """Make the gate of a server on a port, by the names and addresses that lead to it."""
        shown = [f"[{name}]" if ":" in name else name for name in names]
        hosts = {f"{name}:{port}".lower() for name in shown}
        return cls(token, frozenset(hosts | {name.lower() for name in shown if port == 80}))

    def refusal(self, path: str, host: str | None, origin: str | None) -> str:
        """Return why a request is refused, in one sentence; empty if it may come in."""
        if host is None or host.lower() not in self.hosts:
            return "This server is not the host that was asked for; open the printed address."
        if origin is not None and origin.lower() not in {f"http://{name}" for name in self.hosts}:
            return "Another site may not use this server."
        given = path.split("/")[1] if path.startswith("/") else ""
        # compare_digest takes the same time wherever the first wrong letter is
        if not secrets.compare_digest(given.encode(), self.token.encode()):
            return "The address has no valid token; open it as 'tactile view' printed it."
        return ""

    def inside(self, path: str) -> str:
        """Return the path behind the token."""
        return path.partition("?")[0].split("/", 2)[2] if path.count("/") > 1 else ""


def own_token(folder: Path) -> str:
    """Return this user's token, made once, so that a page finds a restarted server again.

    It is kept in a file that only the user can read.

    Raises
    ------
    OSError
        The file cannot be read or written.
    """
    path = folder / "live-page-token"
    try:
        token = path.read_text("ascii").strip()
    except (FileNotFoundError, UnicodeDecodeError):
        token = ""
    if not _TOKEN.fullmatch(token):
        token = secrets.token_urlsafe(32)  # [bytes] as many as a hash has
        folder.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(opened, "w", encoding="ascii") as file:
            file.write(token + "\n")
    return token


def names_of(host: str) -> list[str]:
    """Return the names that lead to a server which listens on an address.

    Raises
    ------
    InputError
        It listens on every address, so that its names are unknown.
    """
    if host == "localhost":
        return ["localhost", "127.0.0.1"]
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return [host]
    if address.is_unspecified:
        raise InputError(
            f"--host {host} is every address of this computer; name the one that the browser will "
            f"use, so that requests to another one can be refused"
        )
    return [host, "localhost"] if address.is_loopback else [host]
