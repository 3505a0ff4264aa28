"""Videos: containers that OpenCV decodes, and MJPEG."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import MAX_PIXELS, regular
from tactile_core.formats.headers import is_torn
from tactile_core.formats.images import ImageKind

# Extensions of the video files, all of which FFmpeg reads.
VIDEO_SUFFIXES = frozenset(
    {".3gp", ".avi", ".flv", ".m2ts", ".m4v", ".mkv", ".mov", ".mp4"}
    | {".mpeg", ".mpg", ".mts", ".ogv", ".ts", ".webm", ".wmv"}
)

NOMINAL_FPS = 30.0  # Frame rate assumed for a file without timestamps, Hz


@dataclass(frozen=True)
class Video:
    """A readable video file.

    Attributes
    ----------
    path : Path
    kind : ImageKind
    fps : float
        From the file, Hz; 0 if the file does not give it.
    """

    path: Path
    kind: ImageKind
    fps: float

    def frames(self, fps: float = NOMINAL_FPS) -> Iterator[tuple[NDArray[Any], float]]:
        """Yield (H, W, 3) uint8 R, G, B pixels and the time since the first frame, s.

        Parameters
        ----------
        fps : float
            Rate of a file that gives neither timestamps nor a rate, Hz.

        Raises
        ------
        InputError
            A frame differs in size from the first.
        """
        import cv2

        capture = _capture(self.path)
        step_s = 1 / (self.fps or fps)
        try:
            time_s = -step_s
            while True:
                ok, bgr = capture.read()
                if not ok:
                    return
                if ImageKind.from_pixels(bgr) != self.kind:
                    raise InputError(
                        f"{self.path} begins with frames of {self.kind}, but continues with "
                        f"{ImageKind.from_pixels(bgr)}; record or convert it again"
                    )
                stamp_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
                # some containers have no timestamps or repeat them
                time_s = stamp_s if stamp_s > time_s else time_s + step_s
                yield np.ascontiguousarray(bgr[..., ::-1]), time_s
        finally:
            capture.release()


def open_video(path: Path) -> Video:
    """Open a video file and check its first frame.

    Raises
    ------
    InputError
        The file is missing, not a video, has no complete frame, or its frames are too large.
    """
    import cv2

    capture = _capture(path)
    try:
        width, height = (
            capture.get(what) for what in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        )
        if width * height > MAX_PIXELS:
            raise InputError(
                f"{path} has frames of {width:.0f} × {height:.0f} pixels, more than the limit of "
                f"{MAX_PIXELS / 1e6:.0f} megapixels; crop it or make it smaller"
            )
        ok, bgr = capture.read()
        fps = float(capture.get(cv2.CAP_PROP_FPS))
    finally:
        capture.release()
    if not ok:
        raise InputError(f"{path} is not a readable video, or contains no complete frame")
    return Video(path, ImageKind.from_pixels(bgr), fps if np.isfinite(fps) and fps > 0 else 0.0)


def _capture(path: Path) -> Any:
    """Open a file with FFmpeg, which does not take '%' in a name for a pattern of names.

    The path is absolute, because FFmpeg takes a relative one such as ``http:v.avi`` for a URL.
    """
    import cv2

    try:
        # OpenCV expects names in UTF-8 in every locale
        name = os.fsencode(regular(path).absolute()).decode()
    except UnicodeDecodeError:
        raise InputError(f"{path}: the name of a video must be in UTF-8; rename it") from None
    capture = cv2.VideoCapture(name, cv2.CAP_FFMPEG)
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)  # like images: as the camera stored it
    return capture


MAX_PART_BYTES = 1 << 26  # Largest image of a stream, bytes; a JPEG of 50 megapixels is smaller

_MAX_HEADER_BYTES = 1 << 14  # Largest header of an image; anything longer is no header

_BLANK_LINE = re.compile(rb"\r?\n\r?\n")  # End of a header

_JPEG = b"\xff\xd8\xff"  # First bytes of a JPEG


@dataclass(frozen=True)
class MjpegPart:
    """One part of a stream.

    Attributes
    ----------
    headers : dict of str to str
        Names in lower case.
    body : bytes
        The image; it may be damaged.
    """

    headers: dict[str, str]
    body: bytes


class MjpegParser:
    """Splits a stream into images, and finds the next one after anything that is none.

    Content lengths are optional and may be wrong: a part ends at the next boundary at the latest,
    and one without a length as soon as its JPEG is complete.

    Parameters
    ----------
    boundary : str
        From the stream's content type, with or without the dashes in front.
    """

    def __init__(self, boundary: str) -> None:
        self._delimiter = b"--" + boundary.encode("latin-1", "replace").lstrip(b"-")
        self._buffer = b""
        self._headers: dict[str, str] | None = None
        self._inside = False

    def feed(self, data: bytes) -> list[MjpegPart]:
        """Add received bytes; return the parts that they complete."""
        self._buffer += data
        parts: list[MjpegPart] = []
        while self._advance(parts):
            pass
        return parts

    def _advance(self, parts: list[MjpegPart]) -> bool:
        """Go to the next boundary, over a header or over an image; False if bytes are missing."""
        if not self._inside:
            return self._seek()
        if self._headers is None:
            return self._read_headers()
        return self._read_body(self._headers, parts)

    def _seek(self) -> bool:
        at = self._buffer.find(self._delimiter)
        if at < 0:
            self._buffer = self._buffer[1 - len(self._delimiter) :]
            return False
        self._buffer = self._buffer[at + len(self._delimiter) :]
        self._inside, self._headers = True, None
        return True

    def _read_headers(self) -> bool:
        end = _BLANK_LINE.search(self._buffer, 0, _MAX_HEADER_BYTES)
        head = self._buffer if end is None else self._buffer[: end.start()]
        if self._delimiter in head or (end is None and len(head) > _MAX_HEADER_BYTES):
            self._inside = False
            return True
        if end is None:
            return False
        pairs = (line.partition(b":") for line in head.splitlines())
        self._headers = {
            name.strip().lower().decode("latin-1"): value.strip().decode("latin-1")
            for name, colon, value in pairs
            if colon
        }
        self._buffer = self._buffer[end.end() :]
        return True

    def _read_body(self, headers: dict[str, str], parts: list[MjpegPart]) -> bool:
        boundary = self._buffer.find(self._delimiter)
        length = _length(headers)
        if length is not None and len(self._buffer) >= length and not 0 <= boundary < length:
            end = length
        elif boundary >= 0:
            end = boundary
        elif length is None and self._buffer.startswith(_JPEG) and not is_torn(self._buffer):
            # Last bytes of a JPEG
            end = (
                self._buffer.rfind(b"\xff\xd9") + 2
            )  # half of the next boundary may follow already
        elif len(self._buffer) > MAX_PART_BYTES:
            end = len(self._buffer)
        else:
            return False
        body, self._buffer, self._inside = self._buffer[:end], self._buffer[end:], False
        parts.append(MjpegPart(headers, body if end == length else body.rstrip(b"\r\n-")))
        return True


def _length(headers: dict[str, str]) -> int | None:
    text = headers.get("content-length", "")
    length = int(text) if text.isdecimal() and len(text) < 12 else 0
    return length if 0 < length <= MAX_PART_BYTES else None
