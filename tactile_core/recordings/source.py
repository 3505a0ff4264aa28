"""Sources of recorded images, by kind."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from tactile_core.algorithms.light.sequence import are_unrelated
from tactile_core.errors import InputError
from tactile_core.formats.files import is_file, status
from tactile_core.formats.images import IMAGE_SUFFIXES, ImageKind, read_image
from tactile_core.formats.video import NOMINAL_FPS, VIDEO_SUFFIXES, Video
from tactile_core.interfaces.recording_format import RecordingFile, RecordingFormat
from tactile_core.interfaces.recording_writer import RecordingWriter
from tactile_core.plugins.blame import blame, fault
from tactile_core.plugins.registry import list_plugins, resolve
from tactile_core.quantities import Image, Pixels
from tactile_core.recordings.session_files import LIST, times_of

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Observation:
    """The exposures of one observation, in the order of the lights."""

    name: str
    images: tuple[Image, ...]


@dataclass(frozen=True)
class Files:
    """The image files of one observation, not yet read."""

    name: str
    paths: tuple[Path, ...]


class ObservationSource(ABC):
    """The observations of a recording, read again with each iteration."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...] | None:
        """Names of the observations; None if their number is unknown before the end."""

    @abstractmethod
    def __iter__(self) -> Iterator[Observation]:
        """Read the observations.

        Raises
        ------
        InputError
            An image is truncated, or has changed since the recording was opened.
        """


@dataclass(frozen=True, eq=False)
class FileSource(ObservationSource):
    """Image files, timed by their names or at a rate.

    Attributes
    ----------
    files : tuple of Files
    kind : ImageKind
        Of every image.
    fps : float
        Images a second, if their names are no times.
    """

    files: tuple[Files, ...]
    kind: ImageKind
    fps: float = NOMINAL_FPS

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the observations."""
        return tuple(files.name for files in self.files)

    def __iter__(self) -> Iterator[Observation]:
        """Read the images."""
        number = 0
        alone = all(len(observation.paths) == 1 for observation in self.files)
        times_s = times_of(self.names) if alone else None
        unrelated = times_s is None and are_unrelated(self._sample_pairs())
        for observation in self.files:
            images = []
            for path in observation.paths:
                pixels = read_image(path)
                if ImageKind.from_pixels(pixels) != self.kind:
                    raise InputError(
                        f"{path} is {ImageKind.from_pixels(pixels)}, but the recording began with "
                        f"{self.kind}; all images of a recording must be of one kind"
                    )
                time_s = number / self.fps if times_s is None else times_s[number]
                images.append(
                    Image(
                        pixels,
                        timestamp_s=time_s,
                        sequence=number,
                        source=observation.name,
                        standalone=unrelated,
                    )
                )
                number += 1
            yield Observation(observation.name, tuple(images))

    def _sample_pairs(self) -> list[tuple[Pixels, Pixels]]:
        """Return pairs of neighbouring images, spread over all."""
        last = len(self.files) - 2
        # [pairs] Reading many takes long
        first = sorted({round(at) for at in np.linspace(0, last, 12)}) if last >= 0 else []
        return [
            (read_image(self.files[at].paths[0]), read_image(self.files[at + 1].paths[0]))
            for at in first
        ]


@dataclass(frozen=True, eq=False)
class VideoSource(ObservationSource):
    """The frames of a video, with its timestamps.

    Attributes
    ----------
    stem : str
        Beginning of the observations' names.
    video : Video
    fps : float
        Frames a second, if the file gives neither timestamps nor a rate.
    """

    stem: str
    video: Video
    fps: float = NOMINAL_FPS

    @property
    def names(self) -> None:
        """The number of frames is unknown before the end."""
        return None

    def __iter__(self) -> Iterator[Observation]:
        """Read the frames."""
        for number, (pixels, time_s) in enumerate(self.video.frames(self.fps)):
            name = f"{self.stem}_{number:06d}"
            image = Image(pixels, timestamp_s=time_s, sequence=number, source=name)
            yield Observation(name, (image,))


_LIVE = ".mcap"  # Ending of what a sensor records; a recording without an ending is a folder

# Formats of other distributions of this project, by the endings of their files.
_BROUGHT = {".h5": "hdf5.h5"}

# Endings of what is certainly no recording, so that no plugin is imported for it.
_OTHER = IMAGE_SUFFIXES | VIDEO_SUFFIXES | {"", ".csv", ".json", ".npz", ".txt", ".yaml", ".yml"}


def copy_formats() -> Mapping[str, str]:
    """Return the recording formats that plugins bring, ``plugin.name`` by the files' ending."""
    found = dict(_BROUGHT)
    for plugin in list_plugins():
        for name in plugin.components.get("recording_format", ()):
            found.setdefault(f".{name.lower()}", f"{plugin.name}.{name}")
    return found


def is_recorded(path: Path) -> bool:
    """Whether the path is that of a recording that a sensor wrote, judging by its name."""
    return path.suffix.lower() == _LIVE or _format_of(path) is not None or is_file(path / LIST)


def writes(path: Path) -> bool:
    """Whether :func:`copy_writer` has a writer for a path: by its ending, or without one."""
    return path.suffix.lower() in ("", _LIVE) or _format_of(path) is not None


def _format_of(path: Path) -> str | None:
    """Return the name of the format that a plugin brings for a path; None without one."""
    ending = path.suffix.lower()
    if ending in _BROUGHT or ending in _OTHER or ending == _LIVE:
        return _BROUGHT.get(ending)
    return copy_formats().get(ending)


def recording_writer(path: Path) -> RecordingWriter:
    """Return the writer of a live recording for a path: MCAP, or a folder if it has no ending.

    Raises
    ------
    InputError
        The path exists, or its ending is that of no format of live recordings.
    """
    if os.path.lexists(path):
        raise InputError(f"{path} already exists; name another file for the recording")
    if _format_of(path) is not None:
        raise InputError(
            f"{path}: a {path.suffix} file is not recorded, but written afterwards by 'tactile "
            f"convert'; record {path.with_suffix(_LIVE).name} first"
        )
    if path.suffix and path.suffix.lower() != _LIVE:
        raise InputError(
            f"{path}: a recording ends in {_LIVE}, or is a folder, whose name has no ending"
        )
    if not path.parent.is_dir():
        raise InputError(f"{path.parent} is no folder; make it, or name another one")
    return copy_writer(path)


def copy_writer(path: Path) -> RecordingWriter:
    """Return the writer of a copy of a recording: MCAP, a plugin's format, or a folder.

    Raises
    ------
    PluginError
        The format's distribution is not installed, or broken.
    """
    return _made(path, lambda form: form.write(path), RecordingWriter)


def recording_file(path: Path) -> RecordingFile:
    """Open a recording that a sensor wrote.

    Raises
    ------
    InputError
        It does not exist, is damaged, or is not of the format that its name says.
    PluginError
        The format's distribution is not installed, or broken.
    """
    status(path)
    return _made(path, lambda form: form.read(path), RecordingFile)


def _made(path: Path, make: Callable[[RecordingFormat], T], wanted: type[Any]) -> T:
    """Return what the format of a path makes; a fault of a plugin's format names it."""
    name, kind = _format(path)
    part = f"the recording format {name!r}"
    with blame(part, kind):
        made = make(kind())
    if not isinstance(made, wanted):
        raise fault(part, kind, f"returned {type(made).__name__}, not a {wanted.__name__}")
    return made


def _format(path: Path) -> tuple[str, type[RecordingFormat]]:
    name = _format_of(path)
    if name is not None:
        return name, resolve("recording_format", name)
    if path.suffix.lower() == _LIVE:
        from tactile_core.recordings.mcap.writer import McapFormat

        return "mcap", McapFormat
    from tactile_core.recordings.folder.file import FolderFormat

    return "folder", FolderFormat
