"""``core.folder``: images as another program puts them into a folder."""

from __future__ import annotations

import os
import time
from fnmatch import fnmatchcase
from pathlib import Path
from threading import Event
from typing import ClassVar, Literal, NamedTuple

from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.errors import CameraLost, CameraTimeout, InputError
from tactile_core.formats.files import read_bytes
from tactile_core.formats.images import IMAGE_SUFFIXES, UnfinishedImage, decode_image
from tactile_core.interfaces.camera import Drop, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.streaming.encoded_image import TornImage, wall_time_at
from tactile_core.interfaces.streaming.streaming_camera import ImageSource, StreamingCamera
from tactile_core.quantities import Image
from tactile_core.recordings.session_files import sorted_by_name


class FolderOptions(Options):
    """Options of ``core.folder``."""

    path: Path | None = Field(default=None, description="The folder.")
    pattern: str = Field(default="*", description="Names of the images, for example 'left_*.png'.")
    order: Literal["name", "mtime"] = Field(
        default="name",
        description="Order of images that are found together: by the numbers and letters of their "
        "names, or by the time of their last change.",
    )
    existing: bool = Field(
        default=False, description="Read the images that are already there as well."
    )
    interval_s: PositiveFloat = Field(
        default=0.05, description="Time between two looks into the folder."
    )
    patience_s: PositiveFloat = Field(
        default=5.0,
        description="Time after which an image that is still incomplete is left out.",
    )


class FolderCamera(StreamingCamera):
    """Delivers images as they appear in a folder; no file is ever changed or deleted.

    A half-written file is awaited, and later ones with it, so that the order holds. A file that is
    replaced or written again is a new image. Nothing is dropped: images wait in the folder.
    Timestamps are the files' times of last change, so clocks of other hosts must agree.
    """

    Options: ClassVar[type[BaseModel]] = FolderOptions
    live: ClassVar[bool] = False
    default_drop: ClassVar[Drop] = "never"

    def __init__(self, options: FolderOptions) -> None:
        super().__init__(options)
        self._settings = options

    @property
    def _name(self) -> str:
        return f"the folder {self._settings.path}"

    def _connect(self) -> ImageSource:
        path = self._settings.path
        if path is None:
            raise InputError(
                "core.folder has no folder to look into; name one in the profile, as "
                "'camera: {use: core.folder, path: …}'"
            )
        if not path.is_dir():
            raise InputError(f"{path} is not a folder; create it or correct 'camera.path'")
        return FolderSource(path, self._settings)

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        # the program that writes the images switches the lights
        return Trigger.CAMERA


class _Version(NamedTuple):
    """Distinguishes files of one name that were written one after another."""

    changed_ns: int
    size: int
    inode: int


class FolderSource(ImageSource):
    """Looks into a folder at intervals, and for at most a tenth of the time.

    Parameters
    ----------
    folder : Path
    options : FolderOptions
    """

    waits: ClassVar[bool] = True

    def __init__(self, folder: Path, options: FolderOptions) -> None:
        self._folder, self._options = folder, options
        self._interrupted = Event()
        self._found: list[str] = []
        self._unfinished: tuple[str, _Version, float] | None = None
        self._last_s = float("-inf")
        self._seen: dict[str, _Version] = {} if options.existing else self._list_files()

    def grab(self) -> Image | None:
        """Return the next complete image."""
        if not self._found:
            self._look()
        while self._found and not self._interrupted.is_set():
            name = self._found[0]
            image = self._read(name)
            if image is not None:
                return image
            if self._unfinished is not None:
                self._pause(self._options.interval_s)
        raise CameraTimeout(f"{self._folder} has no new image")

    def interrupt(self) -> None:
        """End the pause between two looks."""
        self._interrupted.set()

    def close(self) -> None:
        """Do nothing: no file stays open."""

    def _look(self) -> None:
        began_s = time.monotonic()
        listed = self._list_files()
        new = [name for name, version in listed.items() if self._seen.get(name) != version]
        self._found = sorted_by_name(new, str)
        if self._options.order != "name":
            self._found.sort(key=lambda name: listed[name].changed_ns)
        self._seen = {name: seen for name, seen in self._seen.items() if name in listed}
        if not new:
            self._pause(max(self._options.interval_s, 9 * (time.monotonic() - began_s)))

    def _pause(self, seconds: float) -> None:
        self._interrupted.wait(seconds)

    def _list_files(self) -> dict[str, _Version]:
        """Return the image files in the folder."""
        found = {}
        try:
            with os.scandir(self._folder) as entries:
                for entry in entries:
                    if self._is_image(entry.name) and entry.is_file():
                        found[entry.name] = _version(entry.stat())
        except FileNotFoundError:
            if not self._folder.is_dir():
                raise CameraLost(
                    f"the folder {self._folder} has gone; is its disk still connected?"
                ) from None
        except OSError as error:
            raise CameraLost(
                f"the folder {self._folder} can no longer be read: {error.strerror}"
            ) from error
        return found

    def _is_image(self, name: str) -> bool:
        return (
            not name.startswith(".")
            and Path(name).suffix.lower() in IMAGE_SUFFIXES
            and fnmatchcase(name, self._options.pattern)
        )

    def _read(self, name: str) -> Image | None:
        """Return an image; None if the file has gone or is not complete yet."""
        path = self._folder / name
        try:
            before = _version(path.stat())
            data = read_bytes(path)
            version = _version(path.stat())
        except (OSError, InputError):
            if path.exists():
                raise
            self._forget(name)
            return None
        # a file that changes while it is read is not complete, whatever its content
        try:
            pixels = decode_image(data, str(path)) if before == version else None
        except UnfinishedImage:
            pixels = None
        if pixels is None:
            self._wait_for(name, version)
            return None
        replaced = name in self._seen
        self._done(name, version)
        encoded = data if path.suffix.lower() in (".jpg", ".jpeg") else None
        now_s = time.monotonic()
        written_s = now_s - (time.time() - version.changed_ns / 1e9)
        # files of one tick of a coarse clock are different exposures
        self._last_s = max(min(written_s, now_s), self._last_s + 1e-6)
        return Image(
            pixels,
            timestamp_s=self._last_s,
            wall_time_s=wall_time_at(self._last_s),
            source="" if replaced else path.stem,
            encoded=encoded,
        )

    def _wait_for(self, name: str, version: _Version) -> None:
        """Wait for the rest of a file; give it up after a while without any change.

        Raises
        ------
        TornImage
            The rest did not come.
        """
        now_s = time.monotonic()
        if self._unfinished is None or self._unfinished[:2] != (name, version):
            self._unfinished = (name, version, now_s)
        elif now_s - self._unfinished[2] >= self._options.patience_s:
            self._done(name, version)
            raise TornImage(f"{self._folder / name} is incomplete")

    def _done(self, name: str, version: _Version) -> None:
        self._seen[name] = version
        self._forget(name)

    def _forget(self, name: str) -> None:
        self._found.remove(name)
        self._unfinished = None


def _version(status: os.stat_result) -> _Version:
    return _Version(status.st_mtime_ns, status.st_size, status.st_ino)
