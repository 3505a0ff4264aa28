"""The page's server."""

from __future__ import annotations

import asyncio
import errno
import http
import logging
import socket
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Self

from tactile_core.errors import InputError
from tactile_core.interfaces.device import Closing
from tactile_live.desk import Desk
from tactile_live.guiding import Gate, names_of
from tactile_live.session import PageSession

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response


HTML = "text/html; charset=utf-8"

_TYPES = {
    ".html": HTML,
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}

# The page loads only its own files, speaks only with this server, and is in no other page.
PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

# A report is one file with its pictures in it, and runs nothing.
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'; sandbox"
)

HEADERS: Mapping[str, str] = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


@dataclass(frozen=True)
class PageFile:
    """One file: its content type and content."""

    kind: str
    content: bytes


@cache
def page_files() -> Mapping[str, PageFile]:
    """Return all files by the last part of their address; the page itself is ``""``.

    They are read once, and nothing else is ever looked up on the disk, so that no address leads to
    another file.
    """
    folder = Path(__file__).with_name("page")
    files = {
        path.name: PageFile(_TYPES[path.suffix], path.read_bytes())
        for path in folder.iterdir()
        if path.suffix in _TYPES
    }
    return {**files, "": files["index.html"]}


BROWSERS = 16  # Pages and sensors that are watched at once: four pages of four sensors
_HANDSHAKE_S = 5.0  # Time in which a new connection must send its request
_LIVE = "live/"  # Begins the address of a sensor's websocket, before its number

_REPORT = "report/"  # Begins the address of a sensor's calibration report, before its number

_QUIET = logging.getLogger("tactile_live")
_QUIET.addHandler(logging.NullHandler())
_QUIET.propagate = False


def listening(host: str, port: int) -> socket.socket:
    """Return a socket that listens on an address; port 0 chooses a free one.

    Raises
    ------
    InputError
        The port is in use, or the address is not of this computer.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind((host, port))
        sock.listen()
    except OSError as error:
        sock.close()
        if error.errno == errno.EADDRINUSE:
            raise InputError(
                f"port {port} is in use, perhaps by another 'tactile view'; close that one, or "
                f"choose another with --port"
            ) from None
        raise InputError(
            f"the page cannot be served on {host}, port {port}: {error.strerror or error}"
        ) from None
    return sock


class LivePage(Closing):
    """A server of the live page in a thread of its own; use it in a ``with`` block.

    Parameters
    ----------
    desks : sequence of Desk
        Of started sensors, in the order of the page.
    token : str
    host : str
        Address to listen on.
    port : int
        0 chooses a free one.
    say : callable
        Receives a sentence about what goes on when the last page that showed it has left.
    """

    def __init__(
        self,
        desks: Sequence[Desk],
        token: str,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        say: Callable[[str], None] = lambda words: None,
    ) -> None:
        self._say = say
        self.desks = tuple(desks)
        names = names_of(host)
        self._socket = listening(host, port)
        self.port: int = self._socket.getsockname()[1]
        self._gate = Gate.for_port(token, self.port, names)
        shown = f"[{host}]" if ":" in host else host
        self.address = f"http://{shown}:{self.port}/{token}/"
        self._pages: Counter[Desk] = Counter()
        for desk in self.desks:
            desk.live.is_needed = partial(self._is_needed, desk)
        self._loop = asyncio.new_event_loop()
        self._end: asyncio.Event | None = None
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name="live page", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self._ready.wait()
        return self

    def wait(self) -> None:
        """Wait until serving has ended; signals come through."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def close(self) -> None:
        """End serving; pages notice it, and look for the server again."""
        with suppress(RuntimeError):  # it has ended already
            self._loop.call_soon_threadsafe(self._signal_end)
        self._thread.join(5.0)

    def _signal_end(self) -> None:
        if self._end is not None:
            self._end.set()

    def _run(self) -> None:
        with closing(self._loop):
            self._loop.run_until_complete(self._serve())
            self._loop.run_until_complete(self._loop.shutdown_default_executor())

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        self._end = asyncio.Event()
        async with serve(
            self._watch,
            sock=self._socket,
            process_request=self._process,
            max_size=16384,
            max_queue=16,
            compression=None,
            open_timeout=_HANDSHAKE_S,
            close_timeout=1.0,
            server_header=None,
            logger=_QUIET,
        ):
            self._ready.set()
            await self._end.wait()

    def _process(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request; None lets a websocket begin."""
        headers = request.headers
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        host = hosts[0] if len(hosts) == 1 else None
        origin = origins[0] if origins else None
        refusal = self._gate.refusal(request.path, host, origin)
        if refusal:
            return _answer(http.HTTPStatus.FORBIDDEN, refusal)
        inside = self._gate.inside(request.path)
        if inside.startswith(_LIVE):
            if self._desk(inside.removeprefix(_LIVE)) is None:
                return _answer(http.HTTPStatus.NOT_FOUND, "There is no such sensor.")
            if self._pages.total() >= BROWSERS:
                return _answer(
                    http.HTTPStatus.SERVICE_UNAVAILABLE,
                    "Too many pages are open; close one of them.",
                )
            return None
        if inside == "sensors.json":
            names = ",".join(f'"{index}"' for index in range(len(self.desks)))
            return _answer(http.HTTPStatus.OK, f"[{names}]", "application/json")
        if inside.startswith(_REPORT):
            desk = self._desk(inside.removeprefix(_REPORT))
            if desk is None or not desk.guiding.report:
                return _answer(http.HTTPStatus.NOT_FOUND, "There is no report yet.")
            return _response(http.HTTPStatus.OK, desk.guiding.report, HTML, REPORT_POLICY)
        file = page_files().get(inside)
        if file is None:
            return _answer(http.HTTPStatus.NOT_FOUND, "There is no such file.")
        return _response(http.HTTPStatus.OK, file.content, file.kind)

    def _desk(self, number: str) -> Desk | None:
        known = number.isascii() and number.isdigit() and len(number) < 4
        return self.desks[int(number)] if known and int(number) < len(self.desks) else None

    def _is_needed(self, desk: Desk) -> bool:
        """Return whether a page shows a sensor, or something of it goes on without one."""
        return self._pages[desk] > 0 or bool(desk.under_way)

    async def _watch(self, connection: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        request = connection.request
        inside = "" if request is None else self._gate.inside(request.path)
        desk = self._desk(inside.removeprefix(_LIVE))
        if desk is None or self._pages.total() >= BROWSERS:
            await connection.close(1013, "too many pages")
            return
        self._pages[desk] += 1
        try:
            with suppress(ConnectionClosed):
                await PageSession(desk, self.desks.index(desk), connection).run()
        finally:
            self._pages[desk] -= 1
            for one in self.desks if not self._pages.total() else ():
                if one.under_way:
                    self._say(
                        f"no page is open; {one.under_way} of {one.name} goes on until it is ended "
                        f"on the page, or by Ctrl-C"
                    )


def _answer(
    status: http.HTTPStatus, words: str, kind: str = "text/plain; charset=utf-8"
) -> Response:
    return _response(status, words.encode() + b"\n", kind)


def _response(
    status: http.HTTPStatus, body: bytes, kind: str, policy: str = PAGE_POLICY
) -> Response:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    headers = Headers(HEADERS)
    headers["Content-Security-Policy"] = policy
    headers["Content-Type"] = kind
    headers["Content-Length"] = str(len(body))
    headers["Connection"] = "close"
    return Response(status.value, status.phrase, headers, body)
