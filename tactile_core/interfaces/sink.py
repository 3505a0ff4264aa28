"""The sink interface: where readings go; and what a reading holds."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar, overload

from pydantic import BaseModel

from tactile_core.errors import InputError
from tactile_core.formats.text import plain
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.device import Options
from tactile_core.quantities import Frame, Quantity
from tactile_core.quantities.quantity import Guard, pass_errors

Q = TypeVar("Q", bound=Quantity)


@dataclass(frozen=True, eq=False)
class Reading:
    """Everything measured from one frame; ``reading[HeightMap].mm`` is typed.

    ``reading["height"]`` is the result of the profile's step of that name.

    Attributes
    ----------
    frame : Frame
        The measured frame.
    quantities : mapping of type to Quantity
        One quantity of each type.
    steps : mapping of step name to Quantity
        The result of each step of the profile's chain.
    inputs : mapping of type to Quantity
        External inputs that came with the frame, such as a robot's pose.
    latency_ms : float
        Time from the frame to this reading.
    relative : bool
        True if the reference is the session's first frame, so that all values are changes since.
    warnings : tuple of str
        Complete sentences.
    """

    frame: Frame
    quantities: Mapping[type[Quantity], Quantity]
    steps: Mapping[str, Quantity]
    inputs: Mapping[type[Quantity], Quantity] = field(default_factory=dict)
    latency_ms: float = 0.0
    relative: bool = False
    warnings: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        head = f"Reading of {self.source} at {self.frame.timestamp_s:.3f} s"
        warned = [f"warning: {sentence}" for sentence in self.warnings]
        return "\n  ".join([head, *map(repr, self.quantities.values()), *warned])

    @property
    def source(self) -> str:
        """Name of the observation; if it is live, its sequence number in six digits."""
        return self.frame.name

    @overload
    def __getitem__(self, wanted: type[Q]) -> Q: ...
    @overload
    def __getitem__(self, wanted: str) -> Quantity: ...
    def __getitem__(self, wanted: type[Q] | str) -> Q | Quantity:
        found = self.get(wanted)
        if found is None:
            by_step = isinstance(wanted, str)
            there = self.steps if by_step else [kind.__name__ for kind in self.quantities]
            name = f"step {wanted!r}" if isinstance(wanted, str) else wanted.__name__
            raise KeyError(
                f"this reading has no {name}, only {', '.join(sorted(there)) or 'nothing'}; does "
                f"the profile name a step that gives it, and was a bundle loaded?"
            )
        return found

    def __contains__(self, wanted: type[Quantity] | str) -> bool:
        return wanted in (self.steps if isinstance(wanted, str) else self.quantities)

    @overload
    def get(self, wanted: type[Q]) -> Q | None: ...
    @overload
    def get(self, wanted: str) -> Quantity | None: ...
    def get(self, wanted: type[Q] | str) -> Q | Quantity | None:
        """Return the quantity of this type, or of the step of this name, or None."""
        if isinstance(wanted, str):
            return self.steps.get(wanted)
        found = self.quantities.get(wanted)
        return found if isinstance(found, wanted) else None

    def summary(self, guard: Guard = pass_errors) -> dict[str, Any]:
        """Return the line of ``tactile run --json`` as a dict: strict JSON, with None for NaN.

        Parameters
        ----------
        guard : callable, optional
            Returns a context manager for the code of one quantity; it names the quantity's plugin
            if that code fails.
        """
        line: dict[str, Any] = {
            "sequence": self.frame.sequence,
            "timestamp_s": self.frame.timestamp_s,
            "source": self.source,
            "latency_ms": round(self.latency_ms, 3),
            "relative": self.relative,
            "contact_area_mm2": None,
            "max_height_mm": None,
            "wrench": None,
            "slip": None,
            "markers": None,
            "load": None,
            "shows": None,
        }
        for quantity in self.quantities.values():
            with guard(quantity):
                for key, value in plain(quantity.summary()).items():
                    entry = line.get(key)
                    both = isinstance(entry, dict) and isinstance(value, dict)
                    line[key] = entry | value if both else value
        line["source"] = self.source
        line["warnings"] = list(self.warnings)
        return {key: plain(value) for key, value in line.items()}

    def _repr_html_(self) -> str:
        """Return a picture and a table of numbers, which notebooks show."""
        from tactile_core.views.html import notebook_html

        clean = [quantity.finite() for quantity in self.quantities.values()]
        layers = [layer for quantity in clean for layer in quantity.layers()]
        return notebook_html(self.frame, layers, self.summary(), self.warnings)


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
        from tactile_core.formats.folders import make_folder  # only where something is written

        path = folder.path / f"{name}{self.session_ending}"
        if os.path.lexists(path):
            raise InputError(
                f"{path} already exists; move it away, or name another folder for the results"
            )
        make_folder(folder.path)
        return path
