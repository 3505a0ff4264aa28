"""Checks of sinks, on readings of a few virtual presses."""

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
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.footprint import Footprint
from tactile_core.testing.registered import Part, Registered

_ROUNDS = 2


class SinkChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.sink.Sink`."""

    @check(Registered.sinks)
    def test_readings(self, part: Part) -> None:
        """It opens, takes readings of any content, closes, and opens again."""
        for attempt in ("", " again, after it was closed"):
            try:
                self._used(part)
            except Unjudged:
                raise
            except Exception as error:
                raise Fault(
                    part,
                    f"it does not take readings{attempt} ({type(error).__name__}: {error})",
                    why="a reading lacks what the profile has no step for, or no bundle gives",
                    do="ask reading.get(HeightMap) and go on where that is None; acquire in open() "
                    "all that close() releases",
                ) from error

    @check(Registered.sinks)
    def test_files(self, part: Part) -> None:
        """Its files have the endings that it names."""
        endings = self.registered.class_of(part).endings
        for name in self._tried(part):
            if name != WRITTEN and not any(name.endswith(ending) for ending in endings):
                raise Fault(
                    part,
                    f"it writes {name}, and its endings are {endings!r}",
                    why="what must not be replaced is refused by the endings, before measuring",
                    do='endings: ClassVar[tuple[str, ...]] = (".ending",)',
                )

    @check(Registered.sinks)
    def test_leftovers(self, part: Part) -> None:
        """Closing ends every thread and closes every file."""
        self._tried(part)  # what a library keeps for good is acquired by the first opening
        for _ in range(_ROUNDS):
            before = Footprint.now()
            self._tried(part)
            left = before.left()
            if left:
                raise Fault(
                    part,
                    f"after close() there is still {left}",
                    why="a program that measures all day runs out of them",
                    do="end the threads and close the files in close(), and wait for their end",
                )

    def _tried(self, part: Part) -> list[str]:
        try:
            return self._used(part)
        except Unjudged:
            raise
        except Exception as error:
            raise Unjudged(f"see the check 'readings': {error}") from error

    def _used(self, part: Part) -> list[str]:
        """Open it, write, close it; the names of the files that it left."""
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
        except Unjudged:
            raise
        except Exception as error:
            raise Unjudged(f"see the check 'construction': {error}") from error
        return made

    def _readings(self, part: Part) -> list[Reading]:
        """One with nothing in it, then some with all that is known of a press."""
        scenes = self.registered.rig(part).scenes
        readings = [Reading(scenes[0].frame, {}, {})]
        for number, scene in enumerate(scenes, start=1):
            frame = replace(scene.frame, sequence=number, source=f"press_{number}")
            measured = {k: q for k, q in scene.truth.items() if k not in (Frame, Reference)}
            steps = {kind.__name__: quantity for kind, quantity in measured.items()}
            readings.append(Reading(frame, measured, steps))
        return readings
