"""Frames of a video file, one after another, with the times that the file gives them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
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
        """Yield (H, W, 3) uint8 R, G, B pixels and the time since the first frame, s."""
        import cv2

        capture = cv2.VideoCapture(str(self.path))
        step_s = 1 / (self.fps or NOMINAL_FPS)
        try:
            time_s = -step_s
            while True:
                ok, bgr = capture.read()
                if not ok:
                    return
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
        The file is missing, no video, or has not one whole frame.
    """
    import cv2

    if not path.is_file():
        raise InputError(f"{path}: there is no such file; check the path")
    capture = cv2.VideoCapture(str(path))
    try:
        ok, bgr = capture.read()
        fps = float(capture.get(cv2.CAP_PROP_FPS))
    finally:
        capture.release()
    if not ok:
        raise InputError(f"{path} is no video that can be read, or holds no whole frame")
    return Video(path, ImageKind.of(bgr), fps if np.isfinite(fps) and fps > 0 else 0.0)
