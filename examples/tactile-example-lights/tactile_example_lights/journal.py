"""A sink that writes one line of JSON per observation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TextIO

from pydantic import Field

from tactile_core import Reading, Session, Sink
from tactile_core.interfaces.device import Options


class JournalOptions(Options):
    """Options of :class:`Journal`."""

    path: Path = Field(default=Path("journal.jsonl"), description="File to append to.")


class Journal(Sink):
    """Appends a header line about the sensor, then one line per reading."""

    Options = JournalOptions
    options: JournalOptions
    _file: TextIO | None = None

    def open(self, session: Session) -> None:
        """Open the file and write the profile's name and the channels."""
        super().open(session)
        self._file = self.options.path.open("a", encoding="utf-8")
        self._add({"profile": session.build.name, "channels": list(session.channels)})

    def write(self, reading: Reading) -> None:
        """Append the same JSON object as ``tactile run --json``."""
        self._add(reading.summary(self.session.guard))

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _add(self, line: object) -> None:
        print(json.dumps(line), file=self._file, flush=True)
