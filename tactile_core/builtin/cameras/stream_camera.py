"""``core.stream``: images from a network address."""

from __future__ import annotations

import base64
import socket
import time
from contextlib import suppress
from http.client import (
    HTTPConnection,
    HTTPException,
    HTTPResponse,
    HTTPSConnection,
    InvalidURL,
)
from typing import Any, ClassVar
from urllib.parse import SplitResult, unquote, urlsplit

import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.errors import CameraLost, DeviceError, InputError
from tactile_core.formats.catalog import without_secrets
from tactile_core.formats.video import MjpegParser, MjpegPart
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.streaming.encoded_image import (
    EncodedImage,
    encoded_image,
    wall_time_at,
)
from tactile_core.interfaces.streaming.streaming_camera import ImageSource, StreamingCamera
from tactile_core.quantities import Image


class HttpSource(ImageSource):
    """An MJPEG stream over HTTP.

    Parameters
    ----------
    url : SplitResult
    name : str
        The address in messages.
    timeout_s : float

    Raises
    ------
    DeviceError
        There is no such stream; nothing is left open.
    """

    def __init__(self, url: SplitResult, name: str, timeout_s: float) -> None:
        self._name, self._timeout_s = name, timeout_s
        self._parts: list[MjpegPart] = []
        self._last_s = float("-inf")
        self._last_stamp = ""
        kind = HTTPSConnection if url.scheme == "https" else HTTPConnection
        connection = kind(url.hostname or "", url.port, timeout=timeout_s)
        self._connection = connection
        try:
            self._socket, self._response = _request_stream(connection, url, name, timeout_s)
            try:
                self._parser = MjpegParser(_boundary(self._response, url, name))
            except BaseException:
                self._response.close()
                raise
        except BaseException:
            connection.close()
            raise

    def grab(self) -> EncodedImage:
        """Return the next image."""
        while not self._parts:
            self._parts = self._parser.feed(self._receive_chunk())
        part = self._parts.pop(0)
        stamp = part.headers.get("x-timestamp", "")
        # a server without a new image sends the last one again
        if not stamp or stamp != self._last_stamp:
            # [s] two images that arrive together have two times
            self._last_s = max(time.monotonic(), self._last_s + 1e-6)
        self._last_stamp = stamp
        return encoded_image(part.body, self._last_s, self._name)

    def interrupt(self) -> None:
        """End the wait for data."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close the connection."""
        self._response.close()
        self._connection.close()

    def _receive_chunk(self) -> bytes:
        try:
            data = self._response.read1(1 << 16)  # [bytes] at most, at once
        except TimeoutError:
            raise CameraLost(
                f"{self._name} has sent nothing for {self._timeout_s:g} s; check the camera's host "
                f"and the network, or increase 'camera.timeout_s'"
            ) from None
        except (OSError, HTTPException, ValueError) as error:
            raise CameraLost(
                f"the connection to {self._name} broke ({error}); check the camera's host and the "
                f"network"
            ) from error
        if not data:
            raise CameraLost(f"{self._name} ended the stream; check the program on that host")
        return data


def _request_stream(
    connection: HTTPConnection, url: SplitResult, name: str, timeout_s: float
) -> tuple[socket.socket, HTTPResponse]:
    headers = {"Accept": "multipart/x-mixed-replace, image/jpeg"}
    if url.username is not None:
        user = f"{unquote(url.username)}:{unquote(url.password or '')}"
        headers["Authorization"] = f"Basic {base64.b64encode(user.encode()).decode()}"
    try:
        connection.request(
            "GET", (url.path or "/") + (f"?{url.query}" if url.query else ""), headers=headers
        )
        # the response takes the socket over, but only the socket can be interrupted
        wire: socket.socket = connection.sock
        response = connection.getresponse()
    except TimeoutError:
        raise DeviceError(
            f"{name} does not answer within {timeout_s:g} s; check the address, the camera's host "
            f"and the network, or increase 'camera.timeout_s'"
        ) from None
    except ConnectionRefusedError:
        raise DeviceError(
            f"{name} refuses the connection; start the program that sends the stream, or correct "
            f"the port in 'camera.url'"
        ) from None
    except socket.gaierror:
        raise DeviceError(
            f"the host of {name} is not known; correct 'camera.url' or give its number"
        ) from None
    except InvalidURL:  # its message has all of the address
        raise DeviceError(
            f"{name} has a space or another character that no address has; write it as %20"
        ) from None
    except (OSError, HTTPException, ValueError) as error:
        raise DeviceError(
            f"{name} does not answer as a web server does ({error}); check the address and the port"
        ) from error
    return wire, response


def _boundary(response: HTTPResponse, url: SplitResult, name: str) -> str:
    """Return what separates the images of a stream.

    Raises
    ------
    DeviceError
        The answer is not a stream of images.
    """
    if response.status in (401, 403):
        raise DeviceError(
            f"{name} wants a user and a password; write {url.scheme}://user:password@"
            f"{url.hostname}… as 'camera.url'"
        )
    if response.status == 404:
        raise DeviceError(f"there is nothing at {name}; correct 'camera.url'")
    if 300 <= response.status < 400:
        place = without_secrets(response.headers.get("Location", "elsewhere"))
        raise DeviceError(f"{name} has moved to {place}; write that as 'camera.url'")
    if response.status != 200:
        raise DeviceError(
            f"{name} answers {response.status} {response.reason}; check the program on that host"
        )
    kind = response.headers
    boundary = kind.get_boundary()
    if kind.get_content_maintype() == "multipart" and boundary and boundary.strip("-"):
        return boundary
    raise DeviceError(
        f"{name} sends {kind.get_content_type()}, not a stream of images "
        f"(multipart/x-mixed-replace); many cameras have the stream at another path, such as "
        f"/?action=stream or /stream"
    )


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
        url = _check_address(self._settings.url)
        if url.scheme == "rtsp":
            return VideoStream(url.geturl(), self.device_id, self._settings.timeout_s)
        return HttpSource(url, self.device_id, self._settings.timeout_s)


class VideoStream(ImageSource):
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


def _check_address(address: str | None) -> SplitResult:
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
