"""The interface that writes recordings: images as they arrive, events and the session."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactile_core.formats.headers import header
from tactile_core.interfaces.sink import Reading
from tactile_core.interfaces.streaming.encoded_image import EncodedImage
from tactile_core.quantities import Image, Reference


@dataclass(frozen=True, eq=False)
class RecordedSession:
    """What belongs to all images of a recording, so that it can be measured anywhere.

    Attributes
    ----------
    profile : str
        The profile as it was used, with everything that it extends, as YAML.
    sensor : str
        Name of the sensor, for people.
    channels : tuple of str
        The light channels of a frame.
    exposures : int
        Images of one observation.
    sim : bool
        Whether the sensor is virtual, so that ``profile`` has its ``sim`` overlay.
    serial, gel : str or None
        The unit and its gel.
    bundle : mapping of str to bytes, or None
        Content of the files of the bundle, by their names relative to its folder.
    reference : Reference or None
        The undeformed sensor, if it is another one than the bundle's.
    software : mapping of str to str
        Versions of programs and plugins.
    started : str
        Date and time at the beginning, ISO 8601 in UTC.
    tared : bool
        Whether a load had been subtracted before the beginning, which the recording does not hold.
    damaged : tuple of str
        ``"bundle"`` and ``"reference"`` if the recording had them and they cannot be read.
    """

    profile: str
    sensor: str
    channels: tuple[str, ...]
    exposures: int = 1
    sim: bool = False
    serial: str | None = None
    gel: str | None = None
    bundle: Mapping[str, bytes] | None = None
    reference: Reference | None = None
    software: Mapping[str, str] = field(default_factory=dict)
    started: str = ""
    tared: bool = False
    damaged: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class RecordedImage:
    """An image on its way into a recording, exactly as the camera sent it.

    Attributes
    ----------
    image : Image or EncodedImage
        If its ``encoded`` is not None, these bytes are what the camera sent.
    number : int
        Number of the image within the recording, from 0. Images that were dropped have a number,
        too.
    observation : int or None
        Number of the observation that an exposure of a sequence belongs to; None for an image of
        a streaming camera, each of which is an observation.
    exposure_index : int
        Index of the exposure within its observation.
    levels : mapping of light to level
        Brightness 0..1 of each light that was on; empty if nothing switches the lights.
    """

    image: Image | EncodedImage
    number: int
    observation: int | None = None
    exposure_index: int = 0
    levels: Mapping[str, float] = field(default_factory=dict)

    @property
    def size_px(self) -> tuple[int, int] | None:
        """Width and height; None for bytes that are no image."""
        if isinstance(self.image, Image):
            return self.image.pixels.shape[1], self.image.pixels.shape[0]
        found = header(self.image.encoded)
        return None if found is None else (found.width_px, found.height_px)

    @property
    def nbytes(self) -> int:
        """Size of what the camera sent, bytes."""
        encoded = self.image.encoded
        if encoded is not None:
            return len(encoded)
        assert isinstance(self.image, Image)
        return self.image.pixels.nbytes

    def describe_image(self) -> dict[str, Any]:
        """Return everything but the pixels, JSON-ready; floats keep all their digits."""
        return {
            "number": self.number,
            "observation": self.observation,
            "exposure_index": self.exposure_index,
            "levels": {name: float(level) for name, level in self.levels.items()},
            "timestamp_s": self.image.timestamp_s,
            "wall_time_s": self.image.wall_time_s,
            "sequence": self.image.sequence,
            "exposure_time_s": self.image.exposure_time_s,
            "gain": self.image.gain,
        }


class RecordingWriter(ABC):
    """Writes one recording; all its methods are called by one thread, in order.

    What a method has written is readable if the program is killed, unless the format is that of a
    copy only.

    Events (:meth:`write_event`) that a reader of recordings knows:

    ``measured`` ``{"number" or "observation", "tare"}``
        The chain measured this image, or this observation of several exposures.
    ``reference`` ``{"name"}``
        A new reference, which :meth:`write_reference` has written, is used from here on.
    ``resumed`` ``{}``
        Tracking started again, as after a gap.
    ``health`` ``Health.summary()``
        The sensor's health changed.

    Parameters
    ----------
    path : Path
        Does not exist yet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @abstractmethod
    def open(self, session: RecordedSession) -> None:
        """Create the file and write the session.

        Raises
        ------
        InputError
            A library is not installed.
        OSError
            The file exists, or cannot be written.
        """

    @abstractmethod
    def write_image(self, recorded: RecordedImage) -> None:
        """Write an image, losslessly; one that came compressed as the same bytes."""

    @abstractmethod
    def write_event(self, name: str, values: Mapping[str, Any]) -> None:
        """Write an event with JSON-ready values, after the images that came before it."""

    @abstractmethod
    def write_reference(self, name: str, reference: Reference) -> None:
        """Write a reference under a name; the event ``reference`` that names it follows."""

    @abstractmethod
    def write_reading(self, reading: Reading) -> None:
        """Write the quantities of a reading and the line of ``tactile run --json``."""

    @abstractmethod
    def check(self) -> None:
        """Check that the recording still has its name; called every half second.

        Raises
        ------
        FileNotFoundError
            It was deleted, so that all that follows would be lost.
        """

    @abstractmethod
    def close(self) -> None:
        """Complete the file and close it; after an error only close it. May be called twice."""
