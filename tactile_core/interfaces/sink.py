"""The sink interface: a destination of readings, such as files, a viewer or a robot."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol

from pydantic import BaseModel

from tactile_core.errors import InputError
from tactile_core.formats.folders import make_folder
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import Quantity
from tactile_core.quantities.quantity import Guard, pass_errors


class ResultFolder(Protocol):
    """A folder in which only files that a command wrote are replaced."""

    path: Path

    def write_for(self, source: str, ending: str, writer: Callable[[Path], None]) -> Path:
        """Write one file of an observation, completely or not at all."""


class OpenRecording(Protocol):
    """A recording of the sensor that is being written.

    Attributes
    ----------
    failure : str or None
        A sentence that says why it ended early.
    """

    failure: str | None

    def close(self) -> None:
        """Complete it; may be called twice."""


class Recorder(Protocol):
    """Starts a recording of the sensor that the readings come from."""

    def __call__(self, path: Path, readings: bool = False) -> OpenRecording:
        """Record what the camera sends, and the quantities if ``readings`` is true."""


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
    record : Recorder or None
        Records the sensor; None if the readings come from no sensor.
    """

    build: SensorBuild
    serial: str | None
    channels: tuple[str, ...]
    quantities: tuple[type[Quantity], ...]
    folder: ResultFolder | None = None
    guard: Guard = pass_errors
    record: Recorder | None = None


class Sink(ABC):
    """Receives every reading of a session, in order.

    Implement ``write``, and ``open`` and ``close`` if the sink holds resources.

    Attributes
    ----------
    endings : tuple of str
        Endings of the files that :meth:`write_file` writes for each observation, such as
        ``".npz"``. Files of the user that would be overwritten are refused before the first
        measurement.
    session_ending : str
        Ending of the one file or folder that holds the whole session, which :meth:`new_path`
        names, such as ``".rrd"``; ``tactile convert`` chooses the sink by it.
    keeps_raw : bool
        True if the sink writes the images as the camera sent them, ``frame.raw``.
    session : Session
        Available once ``open`` was called.
    """

    Options: ClassVar[type[BaseModel]] = Options
    endings: ClassVar[tuple[str, ...]] = ()
    session_ending: ClassVar[str] = ""
    keeps_raw: ClassVar[bool] = False

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

    def new_path(self) -> Path:
        """Return a path for one file or folder that holds the whole session.

        It is named after the sensor and in a folder that exists; the sink creates it.

        Raises
        ------
        InputError
            The user named no folder, or there is something of that name.
        """
        folder = self.session.folder
        if folder is None:
            raise InputError(f"the sink {type(self).__name__} writes files; name a folder for them")
        serial = self.session.serial
        name = self.session.build.name if serial is None else f"{self.session.build.name}-{serial}"
        path = folder.path / f"{name}{self.session_ending}"
        if os.path.lexists(path):
            raise InputError(
                f"{path} already exists; move it away, or name another folder for the results"
            )
        make_folder(folder.path)
        return path
