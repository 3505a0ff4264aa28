"""A local server of MJPEG streams that behaves as a test wants."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Self

import cv2
import numpy as np

BOUNDARY = "frame"


def jpeg(value: int, size: tuple[int, int] = (48, 64)) -> bytes:
    """Return a grey image of one value as a colour JPEG."""
    return bytes(cv2.imencode(".jpg", np.full((*size, 3), value, np.uint8))[1])


class Exchange:
    """One request, answered by a test's function."""

    def __init__(self, handler: BaseHTTPRequestHandler, stopped: threading.Event) -> None:
        self._handler = handler
        self.stopped = stopped
        self.path = handler.path
        self.headers = handler.headers

    def begin(self, kind: str = f"multipart/x-mixed-replace; boundary={BOUNDARY}") -> None:
        """Send the header of a stream."""
        self._handler.send_response(200)
        self._handler.send_header("Content-Type", kind)
        self._handler.end_headers()

    def fail(self, status: int, **headers: str) -> None:
        """Send the header of an answer that is no stream."""
        self._handler.send_response(status)
        for name, value in headers.items():
            self._handler.send_header(name, value)
        self._handler.end_headers()

    def send(self, data: bytes) -> None:
        """Send bytes as they are."""
        self._handler.wfile.write(data)

    def send_image(self, data: bytes, *, length: int | None = -1, **headers: str) -> None:
        """Send one part; ``length=None`` leaves its length out, -1 gives the right one."""
        lines = [f"--{BOUNDARY}", "Content-Type: image/jpeg"]
        if length is not None:
            lines.append(f"Content-Length: {len(data) if length < 0 else length}")
        lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
        self.send("\r\n".join([*lines, "", ""]).encode() + data + b"\r\n")

    def stall(self) -> None:
        """Send nothing more, but keep the connection."""
        self.stopped.wait(60)


Answer = Callable[[Exchange], None]


class MjpegServer:
    """Answers each request on a free port of this machine with a test's function."""

    def __init__(self, answer: Answer) -> None:
        self.answer = answer
        self.stopped = threading.Event()
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                with suppress(ConnectionError):
                    outer.answer(Exchange(self, outer.stopped))

            def log_message(self, *args: object) -> None:
                pass

        class Server(ThreadingHTTPServer):
            daemon_threads = False

        self._server = Server(("127.0.0.1", 0), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.01,))
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}/stream?view=0"

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End all answers and the server."""
        self.stopped.set()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()
