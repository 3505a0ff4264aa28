"""Recordings: observations read from images, folders, videos, scans or what a sensor recorded.

An observation is the exposure, or the exposures of a light sequence, that make up one frame.
"""

from __future__ import annotations

import stat
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.catalog import Catalog, find_catalog, place_name
from tactile_core.formats.files import regular, status
from tactile_core.formats.images import IMAGE_SUFFIXES, ImageKind, image_kind
from tactile_core.formats.scan import SCAN_FILE, Crop, Scan, read_scan
from tactile_core.formats.video import VIDEO_SUFFIXES, open_video
from tactile_core.interfaces.recording_writer import RecordedSession
from tactile_core.recordings.recorded_source import RecordedSource
from tactile_core.recordings.session_files import sorted_by_name
from tactile_core.recordings.source import (
    Files,
    FileSource,
    Observation,
    ObservationSource,
    VideoSource,
    is_recorded,
    recording_file,
)

_GS_SDK_IMAGE = "gelsight"  # Name of the image in a folder that gs_sdk has written
_BAG = "a ROS bag; extract its images, as PNG files in a folder or as a video"
_ARRAYS = (
    "an array file; save its images as PNG, or measure them in Python by pipeline.frame(image)"
)
_ARCHIVE = "an archive; unpack it"
_HDF5 = "HDF5 of another program; a sensor's recording ends in .h5, and images can be saved as PNG"
# What files are that no recording can be, and what to do with them, by their ending.
_FOREIGN = {
    **dict.fromkeys((".bag", ".db3"), _BAG),
    **dict.fromkeys((".mat", ".npy", ".npz", ".pkl", ".pt"), _ARRAYS),
    **dict.fromkeys((".7z", ".gz", ".rar", ".tar", ".tgz", ".xz", ".zip"), _ARCHIVE),
    **dict.fromkeys((".hdf", ".hdf5", ".he5"), _HDF5),
}
_CHECKED = 500  # Images whose headers are read before the first is measured, if there are more
_YAML = frozenset({".yaml", ".yml"})


@dataclass(frozen=True, eq=False)
class Recording:
    """Observations in order; each iteration reads them again from the start.

    Attributes
    ----------
    path : Path
    kind : ImageKind
        Size, channels and bit depth of every image.
    source : ObservationSource
        Supplies the observations: image files, a video, or what a sensor recorded.
    mm_per_px : float or None
        Scale of the camera's pixels, from the scan file; None if it gives none.
    crop : (x, y, width, height) or None
        From the scan file, in the camera's pixels.
    """

    path: Path
    kind: ImageKind
    source: ObservationSource
    mm_per_px: float | None = None
    crop: Crop | None = None

    @property
    def names(self) -> tuple[str, ...] | None:
        """Names of the observations; None for a video, whose length is unknown before its end."""
        return self.source.names

    @property
    def count(self) -> int | None:
        """Number of observations; None for a video."""
        return None if self.names is None else len(self.names)

    @property
    def files(self) -> tuple[Files, ...]:
        """The image files; empty if the images are not in files of their own."""
        return self.source.files if isinstance(self.source, FileSource) else ()

    @property
    def recorded(self) -> RecordedSource | None:
        """What a sensor recorded besides the images; None if no sensor wrote the recording."""
        return self.source if isinstance(self.source, RecordedSource) else None

    @property
    def session(self) -> RecordedSession | None:
        """The sensor that recorded, with its profile, bundle and reference, if one did."""
        return None if self.recorded is None else self.recorded.session

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the camera's images."""
        return self.kind.width_px, self.kind.height_px

    def with_rate(self, fps: float | None) -> Recording:
        """Return the recording with a rate of the images that have no times of their own, Hz."""
        if fps is None or not isinstance(self.source, FileSource | VideoSource):
            return self
        return replace(self, source=replace(self.source, fps=fps))

    def __iter__(self) -> Iterator[Observation]:
        """Read the observations.

        Images have the timestamps of a video or of a sensor, or those that the names of their
        files give. Others are timed at the rate given by :meth:`at`, or at 30 Hz.

        Raises
        ------
        InputError
            An image is truncated, or has changed since the recording was opened.
        """
        return iter(self.source)


def open_recording(
    path: Path | str, *, images_per_observation: int = 1, every: bool = False
) -> Recording:
    """Open a recording and check that its images belong together.

    Parameters
    ----------
    path : Path
        An image file; a folder of images, in the order of the numbers in their names; a video; a
        ``scan.yaml`` or its folder; a folder of scan folders. For a light sequence also a folder
        with exactly one image per light, or a folder of such folders. A folder whose
        ``catalog.csv`` lists folders (``experiment_reldir``) is the images of these. Or what a
        sensor recorded: an ``.mcap`` file, a folder, or a file of a plugin's recording format.
    images_per_observation : int
        Exposures per frame: 1, or the number of sequential lights.
    every : bool
        Of what a sensor recorded, whether images that it did not measure are observations, too.

    Returns
    -------
    Recording
        All images have the same size, bit depth and colour.

    Raises
    ------
    InputError
        Nothing is readable, the number of images does not match the lights, or images differ;
        the message names them.
    """
    path = Path(path)
    is_folder = stat.S_ISDIR(status(path).st_mode)
    if is_recorded(path):
        source = RecordedSource(recording_file(path), images_per_observation, every=every)
        return Recording(path, source.kind, source)
    if is_folder:
        return _open_folder(path, images_per_observation)
    regular(path)
    suffix = path.suffix.lower()
    if suffix in _YAML:
        return _scans(path, [path], images_per_observation)
    if images_per_observation != 1:
        raise InputError(
            f"{path} is one file, but the rig takes {images_per_observation} images for each "
            f"observation; give a scan.yaml or a folder with exactly {images_per_observation} "
            f"images"
        )
    if suffix in VIDEO_SUFFIXES:
        video = open_video(path)
        return Recording(path, video.kind, VideoSource(path.stem, video))
    if suffix in _FOREIGN:
        raise InputError(f"{path} is {_FOREIGN[suffix]}")
    return _of_files(path, [Files(path.stem, (path,))])


def is_one_recording(path: Path, *, images_per_observation: int = 1) -> bool:
    """Whether :func:`open_recording` takes a path for one recording; a file always is one.

    Parameters
    ----------
    path : Path
    images_per_observation : int
        As of :func:`open_recording`.

    Raises
    ------
    InputError
        The path does not exist, or the folder may not be read.
    """
    if not stat.S_ISDIR(status(path).st_mode) or is_recorded(path):
        return True
    return _opener(path, images_per_observation) is not None


def _open_folder(folder: Path, count: int) -> Recording:
    opens = _opener(folder, count)
    if opens is None:
        raise InputError(f"{folder} has no images{_instead(_visible(folder))}")
    return opens()


def _opener(folder: Path, count: int) -> Callable[[], Recording] | None:
    """Return what opens a folder that is one recording; None if it is none."""
    if (folder / SCAN_FILE).is_file():
        return partial(_scans, folder, [folder / SCAN_FILE], count)
    catalog = find_catalog(folder)
    if catalog is not None and catalog.of_folders:
        return partial(_open_catalogue, folder, catalog, count)
    inside = _visible(folder)
    folders = [path for path in inside if path.is_dir()]
    scans = [path / SCAN_FILE for path in folders if (path / SCAN_FILE).is_file()]
    if scans:
        return partial(_scans, folder, scans, count)
    images = _images_among(inside)
    if images:
        return lambda: _of_files(folder, _observations(folder, images, count))
    if count > 1 and any(_images_among(_visible(one)) for one in folders):
        return partial(_open_sequences, folder, folders, count)
    return None


def _open_sequences(folder: Path, folders: Sequence[Path], count: int) -> Recording:
    """Open folders that hold one observation of a light sequence each."""
    sequences = [_observations(one, _images_among(_visible(one)), count) for one in folders]
    return _of_files(folder, [one for sequence in sequences for one in sequence])


def _open_catalogue(folder: Path, catalog: Catalog, count: int) -> Recording:
    """Open the folders that a catalogue lists, each with one observation or several images."""
    catalog.check_listed()
    scans = [folder / place / SCAN_FILE for place in catalog.diameters_mm]
    if scans and all(scan.is_file() for scan in scans):
        return _scans(folder, scans, count)
    observations = []
    for place in catalog.diameters_mm:
        images = _images_among(_visible(folder / place))
        # folders written by gs_sdk hold drawings beside the image
        images = [image for image in images if image.stem == _GS_SDK_IMAGE] or images
        name = place_name(place)
        if count > 1 or len(images) == 1:
            paths = _check_count(folder / place, tuple(images), count)
            observations.append(Files(name, paths))
        else:
            observations += [Files(f"{name}_{image.stem}", (image,)) for image in images]
    if not observations:
        raise InputError(f"{catalog.path} lists no folder with an image")
    return _of_files(folder, observations)


def _visible(folder: Path) -> list[Path]:
    try:
        paths = [path for path in folder.iterdir() if not path.name.startswith(".")]
    except PermissionError:
        raise InputError(f"{folder} may not be read; change its permissions") from None
    return sorted_by_name(paths, lambda path: path.name)


def _images_among(paths: Sequence[Path]) -> list[Path]:
    return [p for p in paths if p.suffix.lower() in IMAGE_SUFFIXES and p.is_file()]


def _observations(folder: Path, images: Sequence[Path], count: int) -> list[Files]:
    if count > 1:
        return [Files(_name_of(folder), _check_count(folder, tuple(images), count))]
    names: dict[str, Path] = {}
    for path in images:
        other = names.setdefault(path.stem, path)
        if other != path:
            raise InputError(
                f"{other} and {path.name} have the same name, and so would their results; rename "
                f"one of them"
            )
    return [Files(name, (path,)) for name, path in names.items()]


def _scans(path: Path, files: Sequence[Path], count: int) -> Recording:
    scans = {file: read_scan(file) for file in files}
    observations = []
    for file, scan in scans.items():
        folder = file.parent
        images = _check_count(file, tuple(folder / image for image in scan.images), count)
        absent = next((image for image in images if not image.is_file()), None)
        if absent is not None:
            raise InputError(
                f"{file} lists {absent.name}, which is not in the same folder; copy it there"
            )
        observations.append(Files(_name_of(folder), images))
    scale, crop = _common_scale(scans), _common_crop(scans)
    found = _of_files(path, observations)
    return Recording(path, found.kind, found.source, scale, crop)


def _name_of(folder: Path) -> str:
    # a link's own name: the targets of two links can share a name
    name = folder.absolute().name
    return folder.resolve().name if name == ".." else name


def _check_count(where: Path, images: tuple[Path, ...], count: int) -> tuple[Path, ...]:
    if len(images) != count:
        raise InputError(
            f"{where} has {_words(len(images))}, but the rig takes {count} for each observation; "
            f"give exactly {count}, in the order of the lights"
        )
    return images


def _common_scale(scans: dict[Path, Scan]) -> float | None:
    scales = {file: scan.mm_per_px for file, scan in scans.items() if scan.mm_per_px is not None}
    if not scales:
        return None
    low, high = min(scales, key=lambda f: scales[f]), max(scales, key=lambda f: scales[f])
    if scales[high] / scales[low] - 1 > 0.01:  # [ratio] rounding of scales
        raise InputError(
            f"{low} has {scales[low]:g} mm per pixel, but {high} has {scales[high]:g}; they cannot "
            f"be one recording"
        )
    return next(iter(scales.values()))


def _common_crop(scans: dict[Path, Scan]) -> Crop | None:
    crops = {file: scan.crop for file, scan in scans.items() if scan.crop is not None}
    for file, crop in crops.items():
        first = next(iter(crops))
        if crop != crops[first]:
            raise InputError(
                f"{first} has the crop {list(crops[first])}, but {file} has {list(crop)}; they "
                f"cannot be one recording"
            )
    return next(iter(crops.values()), None)


def _of_files(path: Path, observations: Sequence[Files]) -> Recording:
    """Check by headers that images are of one kind; the source checks each as it is read."""
    images = [image for observation in observations for image in observation.paths]
    kind = image_kind(images[0])
    # some of very many, or a long recording waits for seconds before its first reading
    for image in images[1 :: 1 + len(images) // _CHECKED]:
        other = image_kind(image)
        if other != kind:
            raise InputError(
                f"{images[0]} is {kind}, but {image} is {other}; all images of a recording must be "
                f"of one kind"
            )
    return Recording(path, kind, FileSource(tuple(observations), kind))


def _instead(inside: Sequence[Path]) -> str:
    if not inside:
        return "; it is empty"
    videos = [p.name for p in inside if p.suffix.lower() in VIDEO_SUFFIXES]
    folders = [p.name for p in inside if p.is_dir()]
    if videos or folders:
        return f"; name one of its entries, e.g. {(videos or folders)[0]}"
    named = next((p for p in inside if p.suffix.lower() in _FOREIGN), inside[0])
    foreign = _FOREIGN.get(named.suffix.lower(), "")
    return f", only other files, e.g. {named.name}{foreign and f', which is {foreign}'}"


def _words(count: int) -> str:
    return "1 image" if count == 1 else f"{count} images"
