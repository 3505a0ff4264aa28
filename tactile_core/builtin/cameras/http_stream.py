"""An MJPEG stream over HTTP, as a camera's reader thread sees it."""

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
from urllib.parse import SplitResult, unquote

from tactile_core.errors import CameraLost, DeviceError
from tactile_core.formats.address import without_secrets
from tactile_core.formats.mjpeg import MjpegParser, Part
from tactile_core.interfaces.streaming.encoded_image import EncodedImage, encoded_image
from tactile_core.interfaces.streaming.image_reader import ImageSource

_TICK_S = 1e-6  # Time between the timestamps of two images that arrive together, s

_CHUNK_BYTES = 1 << 16  # Most bytes that are received at once


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
        self._parts: list[Part] = []
        self._last_s = float("-inf")
        self._last_stamp = ""
        kind = HTTPSConnection if url.scheme == "https" else HTTPConnection
        connection = kind(url.hostname or "", url.port, timeout=timeout_s)
        self._connection = connection
        try:
            self._socket, self._response = _requested(connection, url, name, timeout_s)
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
            self._parts = self._parser.feed(self._received())
        part = self._parts.pop(0)
        stamp = part.headers.get("x-timestamp", "")
        # a server without a new image sends the last one again
        if not stamp or stamp != self._last_stamp:
            self._last_s = max(time.monotonic(), self._last_s + _TICK_S)
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

    def _received(self) -> bytes:
        try:
            data = self._response.read1(_CHUNK_BYTES)
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


def _requested(
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
