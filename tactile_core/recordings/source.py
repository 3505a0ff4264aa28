"""Where the observations of a recording come from: image files or a video."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core.algorithms.sequence import are_unrelated
from tactile_core.errors import InputError
from tactile_core.formats.images import ImageKind, read_image
from tactile_core.formats.video import NOMINAL_FPS, Video
from tactile_core.quantities import Image, Pixels
from tactile_core.recordings.session_files import times_of

_PAIRS = 12  # Pairs of neighbouring images that are compared, because reading many takes long


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
        first = sorted({round(at) for at in np.linspace(0, last, _PAIRS)}) if last >= 0 else []
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
