"""Checks of devices and sinks."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tactile_core.errors import DeviceError
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import Device
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.interfaces.sink import Reading, Session, Sink
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.output_folder import WRITTEN, OutputFolder
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import depend_on, report, report_errors
from tactile_core.testing.imports import Footprint, find_leaks
from tactile_core.testing.registered import Part

# Public methods that guard state, time limits and lights, by the class that implements them.
_GUARDS = {
    Camera: ("open", "close", "arm", "read", "latest"),
    LightDriver: ("open", "close", "set"),
}


class DeviceChecks(Suite):
    """Opening, closing and released resources."""

    @check("camera", "light_driver")
    def test_guards(self, part: Part) -> None:
        """It implements the methods with an underscore; the public ones, which guard, are ours."""
        cls = self.registered.class_of(part)
        own = [
            name
            for base, names in _GUARDS.items()
            for name in names
            if issubclass(cls, base) and getattr(cls, name) is not getattr(base, name)
        ]
        report(
            part,
            f"it overrides {' and '.join(own)}" if own else "",
            why="they refuse a closed device, close twice without an error, keep time limits, and "
            "switch lights off",
            do="implement _open, _close, _arm, _read or _set, which they call",
        )

    @check("camera", "light_driver")
    def test_opening(self, part: Part) -> None:
        """A device opens, closes, and opens again."""
        device = self.registered.device(part)
        for attempt in ("does not open and close", "no longer opens again after it was closed"):
            with report_errors(
                part,
                f"it {attempt}",
                why="a program could not continue after it loses its camera for a moment",
                do="release in _close everything that _open acquires; without the hardware, "
                f"set options = {{{part.use!r}: {{…}}}} for an emulator, or add the check to "
                "expected_failures",
            ):
                device.open()
                device.close()

    @check("camera", "light_driver")
    def test_failed_opening(self, part: Part) -> None:
        """A failed opening, early or late, leaves nothing open and keeps its own error."""
        open_device(self.registered.device(part)).close()
        for late in (False, True):
            device = _refusing(self.registered.device(part), late=late)
            before = Footprint.take_snapshot()
            try:
                device.open()
            except DeviceError as error:
                notes = " ".join(getattr(error, "__notes__", ()))
            left = before.find_leaks() or ("the device open" if device.is_open else "")
            found = f"then {notes}" if notes else left and f"left {left}"
            when = "after acquiring everything" if late else "before acquiring anything"
            report(
                part,
                found and f"_open failed {when}, and {found}",
                why="the next attempt finds the device busy, and the first error is hidden",
                do="release everything in _close, also after an _open that failed halfway; set the "
                "attributes that it uses in __init__",
            )

    @check("camera", "light_driver")
    def test_leaks(self, part: Part) -> None:
        """Closing a device ends all its threads and closes all its files."""
        device = self.registered.device(part)
        left = find_leaks(lambda: _use(device))
        report(
            part,
            left and f"after close() there is still {left}",
            why="a program that opens it often runs out of resources, and a remaining thread can "
            "keep the device busy",
            do="close the files and end the threads in _close, and wait for the threads",
        )


def open_device(device: Device) -> Any:
    """Open a device.

    Raises
    ------
    CannotCheck
        It does not open.
    """
    with depend_on("opening"):
        return device.open()


def _use(device: Device) -> None:
    """Open a device, read or set levels once, and close it."""
    with open_device(device) as ready, depend_on("image" if hasattr(ready, "read") else "levels"):
        if hasattr(ready, "read"):
            ready.read(5.0)
        else:
            ready.set({})


def _refusing(device: Device, *, late: bool) -> Device:
    """Let the device's next opening fail before or after its own ``_open``."""
    acquire = device._open

    def refuse() -> None:
        if late:
            acquire()
        raise DeviceError("the conformance kit makes this opening fail")

    device._open = refuse  # type: ignore[method-assign]
    return device


class SinkChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.sink.Sink`."""

    @check("sink")
    def test_readings(self, part: Part) -> None:
        """It opens, accepts readings with any quantities, closes, and opens again."""
        for attempt in ("", " again, after it was closed"):
            with report_errors(
                part,
                f"it does not accept readings{attempt}",
                why="a reading lacks quantities without a step in the profile or a bundle",
                do="use reading.get(HeightMap), which may be None; acquire in open() what "
                "close() releases",
            ):
                self._use_sink(part)

    @check("sink")
    def test_files(self, part: Part) -> None:
        """It writes only files with its declared endings."""
        sink = self.registered.class_of(part)
        endings = (*sink.endings, *filter(None, [sink.session_ending]))
        with depend_on("readings"):
            names = self._use_sink(part)
        for name in names:
            known = name == WRITTEN or any(name.endswith(ending) for ending in endings)
            report(
                part,
                "" if known else f"it writes {name}, but its endings are {endings!r}",
                why="the endings are used to protect existing files before measuring",
                do='endings: ClassVar[tuple[str, ...]] = (".ending",)',
            )

    @check("sink")
    def test_sink_leaks(self, part: Part) -> None:
        """Closing a sink ends all its threads and closes all its files."""
        with depend_on("readings"):
            left = find_leaks(lambda: self._use_sink(part))
        report(
            part,
            left and f"after close() there is still {left}",
            why="a program that runs for a long time runs out of resources",
            do="close the files and end the threads in close(), and wait for the threads",
        )

    def _use_sink(self, part: Part) -> list[str]:
        """Open the sink, write readings, close it, and return the names of its files."""
        sink: Sink = self.registered.make_or_skip(part)
        readings = self._readings(part)
        channels, quantities = readings[0].frame.channels, tuple(readings[-1].quantities)
        with TemporaryDirectory() as folder, ExitStack() as closing:
            out = Path(folder) / "out"
            build = self.registered.rig(part).profile
            session = Session(build, "0001", channels, quantities, OutputFolder(out))
            closing.callback(sink.close)
            sink.open(session)
            for reading in readings:
                sink.write(reading)
            closing.close()
            return sorted(path.name for path in out.iterdir()) if out.is_dir() else []

    def _readings(self, part: Part) -> list[Reading]:
        """Return an empty reading, then readings with all quantities of a press."""
        scenes = self.registered.rig(part).scenes
        readings = [Reading(scenes[0].frame, {}, {})]
        for number, scene in enumerate(scenes, start=1):
            frame = replace(scene.frame, sequence=number, source=f"press_{number}")
            measured = {k: q for k, q in scene.truth.items() if k not in (Frame, Reference)}
            steps = {kind.__name__: quantity for kind, quantity in measured.items()}
            readings.append(Reading(frame, measured, steps))
        return readings
