"""Frames of a video file, one after another, with the times that the file gives them."""

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
from tactile_core.formats.headers import MOST_PIXELS
from tactile_core.formats.images import ImageKind

VIDEO_SUFFIXES = frozenset({".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".webm"})

NOMINAL_FPS = 30.0
"""Assumed where a file does not say when its images were taken."""


@dataclass(frozen=True)
class Video:
    """A video file that was found to be readable.

    Attributes
    ----------
    path : Path
    kind : ImageKind
    fps : float
        As the file says; 0 where it does not.
    """

    path: Path
    kind: ImageKind
    fps: float

    def frames(self) -> Iterator[tuple[NDArray[Any], float]]:
        """Yield (H, W, 3) uint8 R, G, B pixels and the time since the first frame, s.

        Raises
        ------
        InputError
            A frame has another size than the first.
        """
        import cv2

        capture = _capture(self.path)
        step_s = 1 / (self.fps or NOMINAL_FPS)
        try:
            time_s = -step_s
            while True:
                ok, bgr = capture.read()
                if not ok:
                    return
                if ImageKind.of(bgr) != self.kind:
                    raise InputError(
                        f"{self.path} begins with frames of {self.kind} and goes on with "
                        f"{ImageKind.of(bgr)}; record or convert it again"
                    )
                told_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
                # some containers carry no times, or repeat them
                time_s = told_s if told_s > time_s else time_s + step_s
                yield np.ascontiguousarray(bgr[..., ::-1]), time_s
        finally:
            capture.release()


def open_video(path: Path) -> Video:
    """Look into a video file.

    Raises
    ------
    InputError
        The file is missing, no video, has not one whole frame, or too large ones.
    """
    import cv2

    capture = _capture(path)
    try:
        width, height = (
            capture.get(what) for what in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
        )
        if width * height > MOST_PIXELS:
            raise InputError(
                f"{path} has frames of {width:.0f} × {height:.0f} pixels, more than the "
                f"{MOST_PIXELS / 1e6:.0f} megapixels that are read; crop it or make it smaller"
            )
        ok, bgr = capture.read()
        fps = float(capture.get(cv2.CAP_PROP_FPS))
    finally:
        capture.release()
    if not ok:
        raise InputError(f"{path} is no video that can be read, or holds no whole frame")
    return Video(path, ImageKind.of(bgr), fps if np.isfinite(fps) and fps > 0 else 0.0)


def _capture(path: Path) -> Any:
    """Open a file with FFmpeg, and as a file: not a name with '%' in it as a pattern of names.

    An absolute path begins with no protocol, as ``http:v.avi`` would.
    """
    import cv2

    try:
        # OpenCV takes names in UTF-8, whatever the locale
        name = os.fsencode(regular(path).absolute()).decode()
    except UnicodeDecodeError:
        raise InputError(f"{path}: the name of a video must be in UTF-8; rename it") from None
    return cv2.VideoCapture(name, cv2.CAP_FFMPEG)
