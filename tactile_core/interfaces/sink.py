"""The sink interface: where readings go, be it files, a recording, a viewer or a robot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol

from pydantic import BaseModel

from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import Quantity
from tactile_core.quantities.quantity import Guard, unguarded


class ResultFolder(Protocol):
    """A folder in which only files that a command wrote are ever replaced."""

    path: Path

    def write_for(self, source: str, ending: str, writer: Callable[[Path], None]) -> Path:
        """Write one file of an observation, whole or not at all."""


@dataclass(frozen=True)
class Session:
    """What a sink may know before the first reading.

    Attributes
    ----------
    build : SensorBuild
        The sensor build: its name, image, gel and lights.
    serial : str or None
        Which physical unit.
    channels : tuple of str
        The light channels of a frame.
    quantities : tuple of type
        What a reading may hold; ``tactile_core.quantities.fields.fields_of`` gives the fields of
        each, with unit and axes.
    folder : ResultFolder or None
        Where files go; None where the user named no folder.
    guard : callable
        Gives a context for the work on one quantity: what the quantity's own code raises in it
        becomes an error that names the quantity's plugin.
    """

    build: SensorBuild
    serial: str | None
    channels: tuple[str, ...]
    quantities: tuple[type[Quantity], ...]
    folder: ResultFolder | None = None
    guard: Guard = unguarded


class Sink(ABC):
    """Takes every reading of a session, in order.

    Authors write ``write``, and ``open`` and ``close`` where the sink holds something.

    Attributes
    ----------
    endings : tuple of str
        Endings of the files that :meth:`write_file` writes for each observation, such as
        ``".npz"``. What must not be replaced in the user's folder is refused before anything is
        measured.
    session : Session
        From ``open`` on.
    """

    Options: ClassVar[type[BaseModel]] = Options
    endings: ClassVar[tuple[str, ...]] = ()

    def __init__(self, options: BaseModel) -> None:
        self.options = options
        self.session: Session

    def open(self, session: Session) -> None:
        """Acquire what is needed, before the first reading; call the inherited one."""
        self.session = session

    @abstractmethod
    def write(self, reading: Reading) -> None:
        """Take one reading."""

    def close(self) -> None:  # noqa: B027  (only sinks that hold something have it to release)
        """Release what ``open`` acquired; what was written stays readable."""

    def write_file(self, reading: Reading, ending: str, writer: Callable[[Path], None]) -> Path:
        """Write one of the :attr:`endings` for an observation, whole or not at all.

        Raises
        ------
        InputError
            The user named no folder, or the file there is not one that a command wrote.
        OSError
            The disk is full or refuses; no file is left half-written.
        """
        folder = self.session.folder
        if folder is None:
            raise InputError(f"the sink {type(self).__name__} writes files; name a folder for them")
        return folder.write_for(reading.source, ending, writer)
