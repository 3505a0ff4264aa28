"""A line of text for each touch, as a robot's log wants it."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

from pydantic import Field

from tactile_core import Reading, Session, Sink
from tactile_core.interfaces.device import Options
from tactile_example_arm.workpiece import TouchPoint


class LogOptions(Options):
    """Options of :class:`Log`."""

    path: Path = Field(default=Path("touches.log"), description="The file, which is added to.")
    decimals: int = Field(default=2, ge=0, le=6, description="Of coordinates in mm.")


class Log(Sink):
    """Adds a line to a file for each reading that has a touch; each is on disk at once."""

    Options = LogOptions
    options: LogOptions
    _file: TextIO | None = None

    def open(self, session: Session) -> None:
        """Begin with a line that says which sensor it is."""
        super().open(session)
        self._file = self.options.path.open("a", encoding="utf-8")
        self._say(f"# {session.build.name} {session.serial or 'without serial'}")

    def write(self, reading: Reading) -> None:
        """Add a line, if there is a touch."""
        touch = reading.get(TouchPoint)
        if touch is not None and touch.world_mm is not None:
            place = " ".join(f"{mm:.{self.options.decimals}f}" for mm in touch.world_mm)
            self._say(f"{reading.source} {place}")

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _say(self, line: str) -> None:
        print(line, file=self._file, flush=True)
