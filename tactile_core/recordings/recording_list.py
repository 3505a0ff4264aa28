"""Several recordings, each with a name: from paths, and from folders that contain recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.printable import printable
from tactile_core.formats.scan import SCAN_FILE
from tactile_core.formats.video import VIDEO_SUFFIXES
from tactile_core.recordings.file_names import sorted_by_name
from tactile_core.recordings.kinds import is_recorded
from tactile_core.recordings.output_folder import safe_stem
from tactile_core.recordings.recording import is_one_recording


@dataclass(frozen=True)
class NamedRecording:
    """A recording, not yet opened.

    Attributes
    ----------
    name : str
        Name of the file without its ending, or of the folder; names the folder of its results.
    path : Path
    """

    name: str
    path: Path


def list_recordings(
    paths: Sequence[Path], *, images_per_observation: int = 1
) -> tuple[NamedRecording, ...]:
    """Return the recordings at these paths, in natural order of the names in each folder.

    A path that :func:`~tactile_core.recordings.recording.open_recording` takes for one recording is
    that recording. Any other folder is a folder of recordings: of the videos, of the files that a
    sensor recorded, and of the folders, in it that are one recording each. Other files in it are
    ignored.

    Parameters
    ----------
    paths : sequence of Path
    images_per_observation : int
        Exposures per frame: 1, or the number of sequential lights.

    Raises
    ------
    InputError
        A path does not exist, a folder contains no recording, or two recordings have the same
        name.
    """
    found = [one for path in paths for one in _recordings_at(path, images_per_observation)]
    names: dict[str, Path] = {}
    for path in found:
        other = names.setdefault(_name_of(path), path)
        if other != path:
            raise InputError(
                f"the results of {other} and of {path} would both be in the folder "
                f"{printable(_name_of(path))}; rename one of them, or measure them into separate "
                f"--out folders"
            )
    return tuple(NamedRecording(name, path) for name, path in names.items())


def is_folder_of_recordings(path: Path, *, images_per_observation: int = 1) -> bool:
    """Whether a path is a folder that is not one recording itself, but contains recordings.

    Raises
    ------
    InputError
        The path does not exist, or the folder may not be read.
    """
    return not is_one_recording(path, images_per_observation=images_per_observation) and bool(
        _inside(path, images_per_observation)
    )


def unread_recordings(folder: Path) -> list[Path]:
    """Return the videos and other recordings in a folder of images, which is read without them."""
    return [] if not folder.is_dir() else [path for path in folder.iterdir() if _is_file(path)]


def _recordings_at(path: Path, count: int) -> list[Path]:
    if is_one_recording(path, images_per_observation=count):
        return [path]
    found = _inside(path, count)
    if not found:
        raise InputError(
            f"{path} contains no recording: no image, scan or video, and no folder of images"
        )
    return found


def _inside(folder: Path, count: int) -> list[Path]:
    entries = sorted_by_name(folder.iterdir(), lambda path: path.name)
    return [path for path in entries if _is_file(path) or _is_folder(path, count)]


def _is_file(path: Path) -> bool:
    shown = not path.name.startswith(".") and path.is_file()
    return shown and (path.suffix.lower() in VIDEO_SUFFIXES or is_recorded(path))


def _is_folder(path: Path, count: int) -> bool:
    shown = not path.name.startswith(".")
    return shown and path.is_dir() and is_one_recording(path, images_per_observation=count)


def _name_of(path: Path) -> str:
    if path.name == SCAN_FILE:
        path = path.parent
    name = path.absolute().name
    if name in ("", ".."):  # a link's own name is kept, but '..' names nothing
        name = path.resolve().name
    return safe_stem(name if path.is_dir() else Path(name).stem)
