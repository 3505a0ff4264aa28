"""Frames of a video file with their timestamps."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import regular
from tactile_core.formats.headers import MAX_PIXELS
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
                if ImageKind.of(bgr) != self.kind:
                    raise InputError(
                        f"{self.path} begins with frames of {self.kind}, but continues with "
                        f"{ImageKind.of(bgr)}; record or convert it again"
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
    return Video(path, ImageKind.of(bgr), fps if np.isfinite(fps) and fps > 0 else 0.0)


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
