"""``core.stream``: a camera on the network, such as that of a Raspberry Pi."""

from __future__ import annotations

import time
from typing import Any, ClassVar
from urllib.parse import SplitResult, urlsplit

import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.builtin.cameras.http_stream import HttpSource
from tactile_core.errors import CameraLost, DeviceError, InputError
from tactile_core.formats.address import without_secrets
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.streaming.encoded_image import wall_time_at
from tactile_core.interfaces.streaming.image_reader import ImageSource
from tactile_core.interfaces.streaming.streaming_camera import StreamingCamera
from tactile_core.quantities import Image


class StreamOptions(Options):
    """Options of ``core.stream``."""

    url: str | None = Field(
        default=None,
        description="Address of the stream: MJPEG as http://host:port/path (https, user:password@ "
        "before the host), or rtsp://host/path.",
    )
    timeout_s: PositiveFloat = Field(
        default=5.0,
        description="Longest wait for the connection, and longest silence before the camera counts "
        "as lost.",
    )


class StreamCamera(StreamingCamera):
    """Reads MJPEG over HTTP, or RTSP, from an address.

    Timestamps are times of arrival, so exposure and transport are included in them.
    """

    Options: ClassVar[type[BaseModel]] = StreamOptions

    def __init__(self, options: StreamOptions) -> None:
        super().__init__(options)
        self._settings = options

    @property
    def device_id(self) -> str:
        """The address, without its secrets."""
        return without_secrets(self._settings.url) if self._settings.url else ""

    def _connect(self) -> ImageSource:
        url = _checked(self._settings.url)
        if url.scheme == "rtsp":
            return VideoSource(url.geturl(), self.device_id, self._settings.timeout_s)
        return HttpSource(url, self.device_id, self._settings.timeout_s)


class VideoSource(ImageSource):
    """A video stream that OpenCV reads with FFmpeg.

    Parameters
    ----------
    url, name : str
        The address, and the address in messages.
    timeout_s : float

    Raises
    ------
    DeviceError
        There is no such stream.
    """

    def __init__(self, url: str, name: str, timeout_s: float) -> None:
        import cv2

        self._name = name
        limit_ms = max(1, round(1e3 * timeout_s))
        self._capture: Any = cv2.VideoCapture(
            url,
            cv2.CAP_FFMPEG,
            [
                *(cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit_ms),
                *(cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit_ms),
                # each further thread of the decoder keeps an image back
                *(cv2.CAP_PROP_N_THREADS, 1),
            ],
        )
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)  # like the stream's recording
        if not self._capture.isOpened():
            self._capture.release()
            raise DeviceError(
                f"{name} sends no video, or not within {timeout_s:g} s; check the address, the "
                f"camera's host and the network"
            )

    def grab(self) -> Image | None:
        """Return the next image."""
        whole, bgr = self._capture.read()
        now_s = time.monotonic()
        if not whole:
            raise CameraLost(
                f"{self._name} ended or sends nothing; check the camera's host and the network"
            )
        pixels = np.ascontiguousarray(bgr[..., ::-1])
        return Image(pixels, timestamp_s=now_s, wall_time_s=wall_time_at(now_s))

    def close(self) -> None:
        """Close the connection."""
        self._capture.release()


def _checked(address: str | None) -> SplitResult:
    if address is None:
        raise InputError(
            "core.stream has no address; write one in the profile, as 'camera: {use: core.stream, "
            'url: "http://host:8080/stream"}\''
        )
    try:
        url = urlsplit(address)
        usable = url.scheme in ("http", "https", "rtsp") and url.hostname and url.port != 0
    except ValueError:  # brackets of an IPv6 address, or a port above 65535
        usable = False
    if not usable:
        raise InputError(
            f"{without_secrets(address)!r} is no address of a stream; write "
            f"http://host:port/path or rtsp://host/path as 'camera.url'"
        )
    return url
