"""The interface of recording formats, and of recordings that a sensor wrote."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.interfaces.device import Closing
from tactile_core.interfaces.recording_writer import RecordedSession, RecordingWriter
from tactile_core.quantities import Image, Pixels, Reference

# Names of the events that change what is measured.
MEASURED, REFERENCE, RESUMED = "measured", "reference", "resumed"


@dataclass(frozen=True)
class ImageEntry:
    """An image of a recording, not yet read.

    Attributes
    ----------
    described : mapping
        As :meth:`RecordedImage.described
        <tactile_core.interfaces.recording_writer.RecordedImage.describe_image>` gave it.
    place : object
        Where the file has it; only the :class:`RecordingFile` that made it understands it.
    """

    described: Mapping[str, Any]
    place: Any


@dataclass(frozen=True)
class EventEntry:
    """An event of a recording.

    Attributes
    ----------
    name : str
    values : mapping
        JSON-ready.
    """

    name: str
    values: Mapping[str, Any]


class RecordingFile(Closing, ABC):
    """One recording of a sensor, in one format; it may be growing, truncated or damaged.

    Attributes
    ----------
    path : Path
    session : RecordedSession
    entries : tuple of ImageEntry or EventEntry
        Everything that is complete, in the order in which it was written.
    finished : bool
        Whether the recording was closed.
    damage : str
        Says how much is damaged and left out; empty if nothing is.
    """

    path: Path
    session: RecordedSession
    entries: tuple[ImageEntry | EventEntry, ...]
    finished: bool
    damage: str = ""

    @property
    def missing(self) -> tuple[str, ...]:
        """Say that a recording is damaged or unfinished; empty if it is neither."""
        said = (self.damage,) if self.damage else ()
        if self.finished:
            return said
        images = sum(isinstance(entry, ImageEntry) for entry in self.entries)
        return (
            *said,
            f"{self.path.name} is unfinished, because it is still being written or was "
            f"interrupted; its {images} complete images are read",
        )

    @abstractmethod
    def close(self) -> None:
        """Close the file; may be called twice."""

    @abstractmethod
    def image(self, entry: ImageEntry) -> Image:
        """Read an image.

        Raises
        ------
        InputError
            It is damaged.
        """

    @abstractmethod
    def reference(self, name: str) -> Reference:
        """Read the reference of this name.

        Raises
        ------
        InputError
            It is damaged or missing.
        """


class RecordingFormat(ABC):
    """Reads and writes recordings in files of one ending, under which it is registered.

    ``tactile convert`` writes it from a recording, and every command reads it; what a sensor sends
    is recorded as MCAP or as a folder of images.
    """

    @abstractmethod
    def write(self, path: Path) -> RecordingWriter:
        """Return the writer of a recording, which creates the file when it is opened."""

    @abstractmethod
    def read(self, path: Path) -> RecordingFile:
        """Open a recording.

        Raises
        ------
        InputError
            It is damaged, or of another format than its name says.
        """


LONGEST_S = 9e9  # Times are not further from zero than this: recorded are nanoseconds of 64 bits


def recorded_image(pixels: Pixels, entry: ImageEntry, encoded: bytes | None = None) -> Image:
    """Return an image with its pixels and what was recorded beside them.

    Raises
    ------
    InputError
        What was recorded beside them is damaged.
    """
    described = entry.described
    try:
        return Image(
            pixels,
            timestamp_s=_finite(described["timestamp_s"]),
            wall_time_s=_finite(described["wall_time_s"]),
            sequence=int(described["sequence"]),
            exposure_index=int(described["exposure_index"]),
            exposure_time_s=_optional(described.get("exposure_time_s")),
            gain=_optional(described.get("gain")),
            encoded=encoded,
        )
    except (ValueError, LookupError, TypeError, OverflowError) as error:
        raise InputError(
            "an image of the recording has a damaged description; copy the recording again"
        ) from error


def _optional(value: Any) -> float | None:
    return None if value is None else _finite(value)


def _finite(value: Any) -> float:
    if not abs(number := float(value)) < LONGEST_S:
        raise ValueError(value)
    return number
