"""A sink that logs one line of text per touch."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

from pydantic import Field

from tactile_core import Reading, Session, Sink
from tactile_core.interfaces.device import Options
from tactile_example_arm.workpiece import TouchPoint


class LogOptions(Options):
    """Options of :class:`Log`."""

    path: Path = Field(default=Path("touches.log"), description="File to append to.")
    decimals: int = Field(default=2, ge=0, le=6, description="Decimals of coordinates in mm.")


class Log(Sink):
    """Appends a line to a file for each reading with a touch, and flushes it."""

    Options = LogOptions
    options: LogOptions
    _file: TextIO | None = None

    def open(self, session: Session) -> None:
        """Write a line with the sensor's name and serial."""
        super().open(session)
        self._file = self.options.path.open("a", encoding="utf-8")
        self._print(f"# {session.build.name} {session.serial or 'without serial'}")

    def write(self, reading: Reading) -> None:
        """Append a line if there is a touch."""
        touch = reading.get(TouchPoint)
        if touch is not None and touch.world_mm is not None:
            position = " ".join(f"{mm:.{self.options.decimals}f}" for mm in touch.world_mm)
            self._print(f"{reading.source} {position}")

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _print(self, line: str) -> None:
        print(line, file=self._file, flush=True)
