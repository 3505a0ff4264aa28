"""A journal of what the bench measured: one line of JSON for each observation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TextIO

from pydantic import Field

from tactile_core import Reading, Session, Sink
from tactile_core.interfaces.device import Options


class JournalOptions(Options):
    """Options of :class:`Journal`."""

    path: Path = Field(default=Path("journal.jsonl"), description="The file, which is added to.")


class Journal(Sink):
    """Adds a line for each reading, and one at the beginning that says what the bench is."""

    Options = JournalOptions
    options: JournalOptions
    _file: TextIO | None = None

    def open(self, session: Session) -> None:
        """Open the file and say which channels a frame has."""
        super().open(session)
        self._file = self.options.path.open("a", encoding="utf-8")
        self._add({"profile": session.build.name, "channels": list(session.channels)})

    def write(self, reading: Reading) -> None:
        """Add what a line of ``tactile run --json`` says."""
        self._add(reading.summary(self.session.guard))

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _add(self, line: object) -> None:
        print(json.dumps(line), file=self._file, flush=True)
