"""Checks of sinks, with readings of virtual presses."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from tactile_core.interfaces.reading import Reading
from tactile_core.interfaces.sink import Session, Sink
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.output_folder import WRITTEN, OutputFolder
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.faults import CannotCheck, Fault
from tactile_core.testing.footprint import Footprint
from tactile_core.testing.registered import Part, Registered

_ROUNDS = 2  # Number of repeated openings in the check of leaks


class SinkChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.sink.Sink`."""

    @check(Registered.sinks)
    def test_readings(self, part: Part) -> None:
        """It opens, accepts readings with any quantities, closes, and opens again."""
        for attempt in ("", " again, after it was closed"):
            try:
                self._used(part)
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
        for name in self._tried(part):
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
        self._tried(part)  # the first opening acquires what libraries keep until the process ends
        for _ in range(_ROUNDS):
            before = Footprint.now()
            self._tried(part)
            left = before.left()
            if left:
                raise Fault(
                    part,
                    f"after close() there is still {left}",
                    why="a program that runs for a long time runs out of resources",
                    do="close the files and end the threads in close(), and wait for the threads",
                )

    def _tried(self, part: Part) -> list[str]:
        try:
            return self._used(part)
        except CannotCheck:
            raise
        except Exception as error:
            raise CannotCheck(f"see the check 'readings': {error}") from error

    def _used(self, part: Part) -> list[str]:
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
