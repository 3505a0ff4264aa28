"""Checks of devices and sinks."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tactile_core.errors import DeviceError
from tactile_core.interfaces.device import Device
from tactile_core.interfaces.sink import Reading, Session, Sink
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.output_folder import WRITTEN, OutputFolder
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import CannotCheck, Fault
from tactile_core.testing.imports import Footprint
from tactile_core.testing.registered import Part, Registered

_ROUNDS = 2  # Number of repeated openings in the check of leaks


class DeviceChecks(Suite):
    """Opening, closing and released resources."""

    @check(Registered.devices)
    def test_opening(self, part: Part) -> None:
        """A device opens, closes, and opens again."""
        device = self.registered.device(part)
        for attempt in ("opens", "opens again after it was closed"):
            try:
                device.open()
                device.close()
            except Exception as error:
                raise Fault(
                    part,
                    f"it no longer {attempt} ({type(error).__name__}: {error})"
                    if "again" in attempt
                    else f"it does not open and close ({type(error).__name__}: {error})",
                    why="a program could not continue after it loses its camera for a moment",
                    do="release in _close everything that _open acquires; without the hardware, "
                    f"set options = {{{part.use!r}: {{…}}}} for an emulator, or add the check to "
                    "expected_failures",
                ) from error

    @check(Registered.devices)
    def test_closing_twice(self, part: Part) -> None:
        """Closing a device twice, or before opening it, does nothing."""
        device = self.registered.device(part)
        try:
            device.close()
            open_device(device).close()
            device.close()
        except CannotCheck:
            raise
        except Exception as error:
            raise Fault(
                part,
                f"closing it twice, or before it was opened, fails ({error!r})",
                why="cleanup after another error would hide that error",
                do="do not override close(); implement _close(), which is called once",
            ) from error

    @check(Registered.devices)
    def test_failed_opening(self, part: Part) -> None:
        """A failed opening, early or late, leaves nothing open and keeps its own error."""
        open_device(self.registered.device(part)).close()
        for late in (False, True):
            device = _refusing(self.registered.device(part), late=late)
            before = Footprint.take_snapshot()
            when = "after acquiring everything" if late else "before acquiring anything"
            try:
                device.open()
            except DeviceError as error:
                notes = " ".join(getattr(error, "__notes__", ()))
            if notes:
                raise Fault(
                    part,
                    f"_open failed {when}, and then {notes}",
                    why="_close is also called after an _open that failed halfway",
                    do="set the attributes that _close uses in __init__, and release only those "
                    "that _open acquired",
                )
            left = before.find_leaks()
            if left or device.is_open:
                raise Fault(
                    part,
                    f"_open failed {when}, and left {left or 'the device open'}",
                    why="the next attempt finds the device busy",
                    do="release everything in _close, also after an _open that failed halfway",
                )

    @check(Registered.devices)
    def test_leaks(self, part: Part) -> None:
        """Closing a device ends all its threads and closes all its files."""
        device = self.registered.device(part)
        use(device)  # the first opening acquires what libraries keep until the process ends
        for _ in range(_ROUNDS):
            before = Footprint.take_snapshot()
            use(device)
            left = before.find_leaks()
            if left:
                raise Fault(
                    part,
                    f"after close() there is still {left}",
                    why="a program that opens it often runs out of resources, and a remaining "
                    "thread can keep the device busy",
                    do="close the files and end the threads in _close, and wait for the threads",
                )


def open_device(device: Device) -> Any:
    """Open a device.

    Raises
    ------
    CannotCheck
        It does not open.
    """
    try:
        return device.open()
    except Exception as error:
        raise CannotCheck(f"see the check 'opening': {error}") from error


def use(device: Device) -> None:
    """Open a device, read or set levels once, and close it."""
    with open_device(device) as ready:
        try:
            if hasattr(ready, "read"):
                ready.read(5.0)
            else:
                ready.set({})
        except Exception as error:
            raise CannotCheck(f"see the checks of this {type(device).__name__}: {error}") from error


def _refusing(device: Device, *, late: bool) -> Device:
    """Let the device's next opening fail before or after its own ``_open``."""
    acquire = device._open

    def refuse() -> None:
        if late:
            acquire()
        raise DeviceError("the conformance kit makes this opening fail")

    device._open = refuse  # type: ignore[method-assign]
    return device


_OPENINGS = 2  # Number of repeated openings in the check of leaks


class SinkChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.sink.Sink`."""

    @check(Registered.sinks)
    def test_readings(self, part: Part) -> None:
        """It opens, accepts readings with any quantities, closes, and opens again."""
        for attempt in ("", " again, after it was closed"):
            try:
                self._use_sink(part)
            except CannotCheck:
                raise
            except Exception as error:
                raise Fault(
                    part,
                    f"it does not accept readings{attempt} ({type(error).__name__}: {error})",
                    why="a reading lacks quantities without a step in the profile or a bundle",
                    do="use reading.get(HeightMap), which may be None; acquire in open() what "
                    "close() releases",
                ) from error

    @check(Registered.sinks)
    def test_files(self, part: Part) -> None:
        """It writes only files with its declared endings."""
        sink = self.registered.class_of(part)
        endings = (*sink.endings, *filter(None, [sink.session_ending]))
        for name in self._try_sink(part):
            if name != WRITTEN and not any(name.endswith(ending) for ending in endings):
                raise Fault(
                    part,
                    f"it writes {name}, but its endings are {endings!r}",
                    why="the endings are used to protect existing files before measuring",
                    do='endings: ClassVar[tuple[str, ...]] = (".ending",)',
                )

    @check(Registered.sinks)
    def test_sink_leaks(self, part: Part) -> None:
        """Closing a sink ends all its threads and closes all its files."""
        self._try_sink(
            part
        )  # the first opening acquires what libraries keep until the process ends
        for _ in range(_OPENINGS):
            before = Footprint.take_snapshot()
            self._try_sink(part)
            left = before.find_leaks()
            if left:
                raise Fault(
                    part,
                    f"after close() there is still {left}",
                    why="a program that runs for a long time runs out of resources",
                    do="close the files and end the threads in close(), and wait for the threads",
                )

    def _try_sink(self, part: Part) -> list[str]:
        try:
            return self._use_sink(part)
        except CannotCheck:
            raise
        except Exception as error:
            raise CannotCheck(f"see the check 'readings': {error}") from error

    def _use_sink(self, part: Part) -> list[str]:
        """Open the sink, write readings, close it, and return the names of its files."""
        sink, readings = self._new_sink(part), self._readings(part)
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

    def _new_sink(self, part: Part) -> Sink:
        try:
            made: Sink = self.registered.make(part)
        except CannotCheck:
            raise
        except Exception as error:
            raise CannotCheck(f"see the check 'construction': {error}") from error
        return made

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
