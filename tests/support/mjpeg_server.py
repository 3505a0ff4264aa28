"""Local servers of MJPEG streams, one of which behaves as a test wants; run with rate and size."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
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
    """Answers each request with a test's function, at a free port of this machine by default."""

    def __init__(self, answer: Answer, port: int = 0) -> None:
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

        self._server = Server(("127.0.0.1", port), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.01,))
        self.port = int(self._server.server_address[1])
        self.url = f"http://127.0.0.1:{self.port}/stream?view=0"

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


class MjpegProcess:
    """A server in a process of its own, which sends images at a rate until it is killed.

    Parameters
    ----------
    rate_hz : float
    size : (rows, columns)
    """

    def __init__(self, rate_hz: float, size: tuple[int, int]) -> None:
        command = [sys.executable, __file__, *map(str, (rate_hz, *size))]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdout is not None
        self.url = self._process.stdout.readline().decode().strip()

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._process:
            self._process.kill()


def main(rate_hz: float, *size: int) -> None:
    """Serve until the input ends."""
    images = [jpeg(value, (size[0], size[1])) for value in (50, 200)]

    def send(exchange: Exchange) -> None:
        exchange.begin()
        due_s, number = time.monotonic(), 0
        while not exchange.stopped.is_set():
            exchange.send_image(images[number % 2])
            due_s, number = due_s + 1 / rate_hz, number + 1
            time.sleep(max(0.0, due_s - time.monotonic()))

    with MjpegServer(send) as server:
        print(server.url, flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main(float(sys.argv[1]), *map(int, sys.argv[2:]))
