"""Sinks that each do one thing wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

from tactile_core.interfaces.sink import Reading, Session, Sink
from tactile_core.quantities import HeightMap


class Depths(Sink):
    """Does nothing wrong: one line an observation."""

    endings: ClassVar[tuple[str, ...]] = (".depth",)

    def write(self, reading: Reading) -> None:
        height = reading.get(HeightMap)
        text = "none" if height is None else f"{height.mm.max():.3f}"
        self.write_file(reading, ".depth", lambda path: self._note(path, text))

    def _note(self, path: Path, text: str) -> None:
        path.write_text(text)


class Expectant(Depths):
    """Takes every reading to have a height."""

    def write(self, reading: Reading) -> None:
        assert reading[HeightMap]


class Unnamed(Depths):
    """Does not say which files it writes."""

    endings: ClassVar[tuple[str, ...]] = ()


class Careless(Depths):
    """Never closes its log."""

    logs: ClassVar[list[Any]] = []

    def open(self, session: Session) -> None:
        super().open(session)
        self.logs.append(Path(__file__).open(encoding="utf-8"))  # noqa: SIM115


class Exhausted(Depths):
    """Can be closed once in a lifetime."""

    spent: ClassVar[bool] = False

    def close(self) -> None:
        if type(self).spent:
            raise RuntimeError("closed before")
        type(self).spent = True
