"""The sink interface: a destination of readings, such as files, a viewer or a robot."""

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
    """A folder in which only files that a command wrote are replaced."""

    path: Path

    def write_for(self, source: str, ending: str, writer: Callable[[Path], None]) -> Path:
        """Write one file of an observation, completely or not at all."""


@dataclass(frozen=True)
class Session:
    """What a sink knows before the first reading.

    Attributes
    ----------
    build : SensorBuild
        The sensor build: its name, image, gel and lights.
    serial : str or None
        Serial number of the physical unit.
    channels : tuple of str
        The light channels of a frame.
    quantities : tuple of type
        Types that a reading can contain; ``tactile_core.quantities.fields.fields_of`` lists the
        fields of each, with unit and axes.
    folder : ResultFolder or None
        Destination of files; None if the user named no folder.
    guard : callable
        Returns a context manager for the code of one quantity: an exception in it becomes an
        error that names the quantity's plugin.
    """

    build: SensorBuild
    serial: str | None
    channels: tuple[str, ...]
    quantities: tuple[type[Quantity], ...]
    folder: ResultFolder | None = None
    guard: Guard = unguarded


class Sink(ABC):
    """Receives every reading of a session, in order.

    Implement ``write``, and ``open`` and ``close`` if the sink holds resources.

    Attributes
    ----------
    endings : tuple of str
        Endings of the files that :meth:`write_file` writes for each observation, such as
        ``".npz"``. Files of the user that would be overwritten are refused before the first
        measurement.
    session : Session
        Available once ``open`` was called.
    """

    Options: ClassVar[type[BaseModel]] = Options
    endings: ClassVar[tuple[str, ...]] = ()

    def __init__(self, options: BaseModel) -> None:
        self.options = options
        self.session: Session

    def open(self, session: Session) -> None:
        """Acquire resources before the first reading; overrides must call ``super().open``."""
        self.session = session

    @abstractmethod
    def write(self, reading: Reading) -> None:
        """Process one reading."""

    def close(self) -> None:  # noqa: B027  (optional hook)
        """Release what ``open`` acquired; files that were written stay readable."""

    def write_file(self, reading: Reading, ending: str, writer: Callable[[Path], None]) -> Path:
        """Write one of the :attr:`endings` for an observation, completely or not at all.

        Raises
        ------
        InputError
            The user named no folder, or a file of that name exists that no command wrote.
        OSError
            The disk is full or not writable; no file is left half-written.
        """
        folder = self.session.folder
        if folder is None:
            raise InputError(f"the sink {type(self).__name__} writes files; name a folder for them")
        return folder.write_for(reading.source, ending, writer)
