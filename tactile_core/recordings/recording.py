"""Recordings: files on disk as a sequence of observations, whatever they were stored as.

An observation is the exposure, or the exposures of a sequence of lights, that make one frame.
"""

from __future__ import annotations

import re
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.files import regular, status
from tactile_core.formats.images import (
    IMAGE_SUFFIXES,
    ImageKind,
    image_kind,
    read_image,
)
from tactile_core.formats.scan import SCAN_FILE, Crop, Scan, read_scan
from tactile_core.formats.video import NOMINAL_FPS, VIDEO_SUFFIXES, Video, open_video
from tactile_core.quantities import Image

_SCALE_TOLERANCE = 0.01
_YAML = frozenset({".yaml", ".yml"})


@dataclass(frozen=True, eq=False)
class Observation:
    """The exposures of one observation, in the order of the lights."""

    name: str
    images: tuple[Image, ...]


@dataclass(frozen=True)
class Files:
    """One observation's image files, not read yet."""

    name: str
    paths: tuple[Path, ...]


@dataclass(frozen=True, eq=False)
class Recording:
    """Observations in order; iterating reads them one after another, as often as wanted.

    Attributes
    ----------
    path : Path
    kind : ImageKind
        Size, channels and depth that every image has.
    mm_per_px : float or None
        As the scan says; None where nothing is said.
    crop : (x, y, width, height) or None
        As the scan says, in the camera's pixels.
    files : tuple of Files
        Empty for a video.
    video : Video or None
    """

    path: Path
    kind: ImageKind
    mm_per_px: float | None = None
    crop: Crop | None = None
    files: tuple[Files, ...] = ()
    video: Video | None = None

    @property
    def count(self) -> int | None:
        """How many observations there are; None for a video, whose end shows only when reached."""
        return len(self.files) if self.video is None else None

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the camera's images."""
        return self.kind.width_px, self.kind.height_px

    def __iter__(self) -> Iterator[Observation]:
        """Read the observations.

        A video's images carry the times of its frames; files carry none, so theirs are those of a
        camera at 30 Hz.

        Raises
        ------
        InputError
            An image is truncated, or has changed since the recording was opened.
        """
        return self._frames(self.video) if self.video is not None else self._images()

    def _frames(self, video: Video) -> Iterator[Observation]:
        for number, (pixels, time_s) in enumerate(video.frames()):
            name = f"{self.path.stem}_{number:06d}"
            image = Image(pixels, timestamp_s=time_s, sequence=number, source=name)
            yield Observation(name, (image,))

    def _images(self) -> Iterator[Observation]:
        number = 0
        for observation in self.files:
            images = []
            for path in observation.paths:
                pixels = read_image(path)
                if ImageKind.of(pixels) != self.kind:
                    raise InputError(
                        f"{path} is {ImageKind.of(pixels)} where its header said {self.kind}; "
                        f"record or save it again"
                    )
                time_s = number / NOMINAL_FPS
                images.append(
                    Image(pixels, timestamp_s=time_s, sequence=number, source=observation.name)
                )
                number += 1
            yield Observation(observation.name, tuple(images))


def open_recording(path: Path | str, *, images_per_observation: int = 1) -> Recording:
    """Find out what a recording holds, and check that its images belong together.

    Parameters
    ----------
    path : Path
        An image file; a folder of images, in natural order of their names; a video; a
        ``scan.yaml`` or the folder of one; a folder of scan folders; for a sequence of lights also
        a folder with exactly one image per light, or a folder of such folders.
    images_per_observation : int
        How many exposures the rig takes for one frame: 1, or its number of lights.

    Returns
    -------
    Recording
        Its images are all of one size, depth and colour.

    Raises
    ------
    InputError
        There is nothing that can be read, a number of images does not fit the lights, or images
        differ; the message names them.
    """
    path = Path(path)
    if stat.S_ISDIR(status(path).st_mode):
        return _open_folder(path, images_per_observation)
    regular(path)
    suffix = path.suffix.lower()
    if suffix in _YAML:
        return _scans(path, [path], images_per_observation)
    if images_per_observation != 1:
        raise InputError(
            f"{path} is one file and the rig takes {images_per_observation} images for each "
            f"observation; give a scan.yaml or a folder with exactly {images_per_observation} "
            f"images"
        )
    if suffix in VIDEO_SUFFIXES:
        video = open_video(path)
        return Recording(path, video.kind, video=video)
    return _of_files(path, [Files(path.stem, (path,))])


def _open_folder(folder: Path, count: int) -> Recording:
    if (folder / SCAN_FILE).is_file():
        return _scans(folder, [folder / SCAN_FILE], count)
    inside = _visible(folder)
    folders = [path for path in inside if path.is_dir()]
    scans = [path / SCAN_FILE for path in folders if (path / SCAN_FILE).is_file()]
    if scans:
        return _scans(folder, scans, count)
    images = _images_among(inside)
    if images:
        return _of_files(folder, _observations(folder, images, count))
    if count > 1 and folders:
        sequences = [_observations(p, _images_among(_visible(p)), count) for p in folders]
        return _of_files(folder, [one for sequence in sequences for one in sequence])
    raise InputError(f"{folder} holds no images{_instead(inside)}")


def _visible(folder: Path) -> list[Path]:
    try:
        paths = [path for path in folder.iterdir() if not path.name.startswith(".")]
    except PermissionError:
        raise InputError(f"{folder} may not be read; change its permissions") from None
    return sorted(paths, key=_natural)


def _images_among(paths: Sequence[Path]) -> list[Path]:
    return [p for p in paths if p.suffix.lower() in IMAGE_SUFFIXES and p.is_file()]


def _observations(folder: Path, images: Sequence[Path], count: int) -> list[Files]:
    if count > 1:
        return [Files(_name_of(folder), _counted(folder, tuple(images), count))]
    names: dict[str, Path] = {}
    for path in images:
        other = names.setdefault(path.stem, path)
        if other != path:
            raise InputError(
                f"{other} and {path.name} have one name, so their results would too; rename one"
            )
    return [Files(name, (path,)) for name, path in names.items()]


def _scans(path: Path, files: Sequence[Path], count: int) -> Recording:
    scans = {file: read_scan(file) for file in files}
    observations = []
    for file, scan in scans.items():
        folder = file.parent
        images = _counted(file, tuple(folder / image for image in scan.images), count)
        absent = next((image for image in images if not image.is_file()), None)
        if absent is not None:
            raise InputError(f"{file} lists {absent.name}, which is not beside it; bring it there")
        observations.append(Files(_name_of(folder), images))
    scale, crop = _common_scale(scans), _common_crop(scans)
    found = _of_files(path, observations)
    return Recording(path, found.kind, scale, crop, found.files)


def _name_of(folder: Path) -> str:
    # a link's own name: where two of them lead to may have one name
    name = folder.absolute().name
    return folder.resolve().name if name == ".." else name


def _counted(where: Path, images: tuple[Path, ...], count: int) -> tuple[Path, ...]:
    if len(images) != count:
        raise InputError(
            f"{where} has {_words(len(images))} and the rig takes {count} for each observation; "
            f"give exactly {count}, in the order of the lights"
        )
    return images


def _common_scale(scans: dict[Path, Scan]) -> float | None:
    told = {file: scan.mm_per_px for file, scan in scans.items() if scan.mm_per_px is not None}
    if not told:
        return None
    low, high = min(told, key=lambda f: told[f]), max(told, key=lambda f: told[f])
    if told[high] / told[low] - 1 > _SCALE_TOLERANCE:
        raise InputError(
            f"{low} says {told[low]:g} mm per pixel and {high} says {told[high]:g}; they cannot be "
            f"one recording"
        )
    return next(iter(told.values()))


def _common_crop(scans: dict[Path, Scan]) -> Crop | None:
    told = {file: scan.crop for file, scan in scans.items() if scan.crop is not None}
    for file, crop in told.items():
        first = next(iter(told))
        if crop != told[first]:
            raise InputError(
                f"{first} has the crop {list(told[first])} and {file} {list(crop)}; they cannot be "
                f"one recording"
            )
    return next(iter(told.values()), None)


def _of_files(path: Path, observations: Sequence[Files]) -> Recording:
    """Check by the headers alone that the images belong together, before anything is measured."""
    images = [image for observation in observations for image in observation.paths]
    kind = image_kind(images[0])
    for image in images[1:]:
        other = image_kind(image)
        if other != kind:
            raise InputError(
                f"{images[0]} is {kind} and {image} is {other}; one recording has images of one "
                f"kind"
            )
    return Recording(path, kind, files=tuple(observations))


def _instead(inside: Sequence[Path]) -> str:
    if not inside:
        return "; it is empty"
    videos = [p.name for p in inside if p.suffix.lower() in VIDEO_SUFFIXES]
    folders = [p.name for p in inside if p.is_dir()]
    if videos or folders:
        return f"; name one of what it holds, e.g. {(videos or folders)[0]}"
    return f", only other files, e.g. {inside[0].name}"


def _words(count: int) -> str:
    return "1 image" if count == 1 else f"{count} images"


def _natural(path: Path) -> tuple[list[str | int], str]:
    parts = re.split(r"([0-9]+)", path.name.casefold())
    return [int(part) if i % 2 else part for i, part in enumerate(parts)], path.name
