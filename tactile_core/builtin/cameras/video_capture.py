"""Images of a local camera through OpenCV, as a camera's reader thread sees it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from threading import Event
from typing import Any, NamedTuple

import numpy as np

from tactile_core.errors import BandwidthError, CameraLost, CameraTimeout, DeviceError
from tactile_core.interfaces.streaming.encoded_image import (
    EncodedImage,
    TornImage,
    encoded_image,
    wall_time_at,
)
from tactile_core.interfaces.streaming.streaming_camera import ImageSource
from tactile_core.quantities import Image

# Variable with the seconds after which OpenCV gives up a read; it looks once a process.
_SELECT_TIMEOUT = "OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT"

# [s] Longest wait of one read: the shortest that OpenCV allows; it bounds the time that closing
# takes while a camera stalls
_SELECT_S = 1


class Wanted(NamedTuple):
    """Format of the images; None leaves the choice to the camera."""

    width_px: int | None
    height_px: int | None
    fps: float | None
    format: str
    buffers: int | None


class VideoCapture(ImageSource):
    """An open camera of OpenCV.

    Parameters
    ----------
    device : str or int
        Device file, or index where there are no device files.
    name : str
        In messages.
    wanted : Wanted
    is_connected : callable
        Returns False once the camera is unplugged.

    Attributes
    ----------
    exposure_time_s, gain : float or None
        What the images carry; set after the camera has been locked.
    valid_from_s : float
        Images exposed before this time are left out, because settings changed.

    Raises
    ------
    DeviceError
        OpenCV cannot open the camera, or it refuses the format.
    """

    def __init__(
        self,
        device: str | int,
        name: str,
        wanted: Wanted,
        is_connected: Callable[[], bool] = lambda: True,
    ) -> None:
        os.environ.setdefault(_SELECT_TIMEOUT, str(_SELECT_S))
        import cv2

        self.exposure_time_s: float | None = None
        self.gain: float | None = None
        self.valid_from_s = float("-inf")
        self._name, self._is_connected = name, is_connected
        self._interrupted = Event()
        self._failing_since_s: float | None = None
        backend = cv2.CAP_V4L2 if isinstance(device, str) else cv2.CAP_ANY
        self._capture: Any = cv2.VideoCapture(device, backend)
        self._is_raw = False
        try:
            if not self._capture.isOpened():
                raise DeviceError(f"{name} cannot be opened")
            self._choose(wanted)
        except BaseException:
            self._capture.release()
            raise

    @property
    def described(self) -> str:
        """Size, rate and format that the camera chose."""
        import cv2

        width, height, fps = (
            self._capture.get(what)
            for what in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT, cv2.CAP_PROP_FPS)
        )
        return f"{width:.0f} × {height:.0f} pixels, {fps:g} images a second, {self._format()}"

    @property
    def rate_hz(self) -> float:
        """Rate that the camera chose, Hz; 0 if it does not say."""
        import cv2

        return float(self._capture.get(cv2.CAP_PROP_FPS))

    def await_first(self) -> None:
        """Wait for the first image.

        Raises
        ------
        BandwidthError
            None comes.
        """
        until_s = time.monotonic() + 5.0  # [s] webcams start within two; the rest is reserve
        while True:
            try:
                self.grab()
            except TornImage:
                return
            except CameraTimeout:
                if time.monotonic() < until_s:
                    continue
            except CameraLost:
                pass
            else:
                return
            raise BandwidthError(
                f"{self._name} is open but sends no image; cameras on one USB hub share its "
                f"bandwidth, so connect it to another port of the computer, or lower its size or "
                f"rate, or set 'camera.format: MJPG'"
            )

    def grab(self) -> Image | EncodedImage:
        """Return the next image."""
        import cv2

        began_s = time.monotonic()
        whole = self._capture.grab()
        now_s = time.monotonic()
        if not whole:
            self._fail(began_s, now_s)
        self._failing_since_s = None
        stamp_s = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
        if abs(now_s - stamp_s) > 10.0:  # [s] another clock differs by more
            stamp_s = now_s
        # drivers note when the first bytes arrive, which is after the exposure
        stamp_s -= (self.exposure_time_s or 0.0) / 2
        whole, data = self._capture.retrieve()
        if not whole or data is None or not data.size:
            raise TornImage(f"{self._name} sent an image that cannot be decoded")
        if stamp_s < self.valid_from_s:
            raise CameraTimeout(f"{self._name} has no image with its new settings yet")
        if self._is_raw:
            return encoded_image(
                data.tobytes(),
                stamp_s,
                self._name,
                exposure_time_s=self.exposure_time_s,
                gain=self.gain,
            )
        return Image(
            np.ascontiguousarray(data[..., ::-1]) if data.ndim == 3 else data.copy(),
            timestamp_s=stamp_s,
            wall_time_s=wall_time_at(stamp_s),
            exposure_time_s=self.exposure_time_s,
            gain=self.gain,
        )

    def interrupt(self) -> None:
        """End the pause after a failure; a read that waits ends by itself."""
        self._interrupted.set()

    def close(self) -> None:
        """Release the camera."""
        self._capture.release()

    def _fail(self, began_s: float, now_s: float) -> None:
        """Raise why there is no image."""
        if not self._is_connected():
            raise CameraLost(f"{self._name} was unplugged; connect it again and reopen it")
        if now_s - began_s > _SELECT_S / 2:
            self._failing_since_s = None
            raise CameraTimeout(f"{self._name} sends nothing")
        self._failing_since_s = self._failing_since_s or began_s
        if now_s - self._failing_since_s > 1.0:  # [s] half of the time in which a loss is reported
            raise CameraLost(
                f"{self._name} is connected but sends no more images; unplug it once, or connect "
                f"it to another port"
            )
        self._interrupted.wait(0.03)  # [s] a frame period at 30 Hz: nothing is missed
        raise CameraTimeout(f"{self._name} sends nothing")

    def _choose(self, wanted: Wanted) -> None:
        import cv2

        # the format comes first: sizes and rates depend on it
        self._capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*wanted.format))
        settings = {
            "width_px": (cv2.CAP_PROP_FRAME_WIDTH, wanted.width_px),
            "height_px": (cv2.CAP_PROP_FRAME_HEIGHT, wanted.height_px),
            "fps": (cv2.CAP_PROP_FPS, wanted.fps),
            "buffers": (cv2.CAP_PROP_BUFFERSIZE, wanted.buffers),
        }
        for what, value in settings.values():
            if value is not None:
                self._capture.set(what, value)
        # setting one can change another, so all are read back afterwards
        for option, (what, value) in settings.items():
            got = self._capture.get(what)
            if value is not None and abs(got - value) > 0.01 * value:
                raise DeviceError(
                    f"{self._name} chose {option}: {got:g} instead of {value:g} with "
                    f"{self._format()}; correct 'camera.{option}' (on Linux, 'v4l2-ctl "
                    f"--list-formats-ext' lists what it can send)"
                )
        if self._format() != wanted.format:
            raise DeviceError(
                f"{self._name} sends {self._format()}, not {wanted.format}; write that as "
                f"'camera.format'"
            )
        if wanted.format == "MJPG" and self._capture.getBackendName() == "V4L2":
            # then a read gives the bytes that the camera sent
            self._is_raw = bool(self._capture.set(cv2.CAP_PROP_CONVERT_RGB, 0))

    def _format(self) -> str:
        import cv2

        code = int(self._capture.get(cv2.CAP_PROP_FOURCC)) & 0xFFFFFFFF
        return code.to_bytes(4, "little").decode("ascii", "replace")
