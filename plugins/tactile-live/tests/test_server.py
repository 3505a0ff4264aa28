"""A page of one sensor: what it shows, what it obeys, and whom it keeps out."""

from __future__ import annotations

import http.client
import json
import socket
import struct
import threading
import time
from contextlib import ExitStack, suppress
from urllib.parse import urlsplit

import numpy as np
import pytest
from support.watching import TOKEN, Watcher, until, watching
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from tactile_core.errors import InputError
from tactile_core.quantities import HeightMap
from tactile_live import server
from tactile_live.desk import Desk
from tactile_live.server import LivePage


def get(page: LivePage, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Ask for a file, exactly by this path."""
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10)
    try:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
    finally:
        connection.close()


def measures_on(desk: Desk) -> None:
    """Check that the sensor goes on."""
    before = _number(desk)
    until(lambda: _number(desk) > before + 3)


def _number(desk: Desk) -> int:
    state = desk.live.newest.value
    return 0 if state is None else state.number


def test_it_shows_the_picture_the_height_and_the_contact_of_a_reading(page: LivePage) -> None:
    with watching(page.address) as watcher:
        message = watcher.next()
    header = message.header
    assert header["size"] == [160, 120]
    assert message.bytes(header["picture"])[:2] == b"\xff\xd8"
    assert header["maps_there"][0]["title"] == "height"
    assert [overlay["title"] for overlay in header["overlays"]] == ["contact"]
    assert header["featured"] == ["max_height_mm", "contact_area_mm2"]


def test_a_map_has_the_numbers_that_were_measured(page: LivePage, desk: Desk) -> None:
    desk.live.do(lambda: desk.live.play(paused=True)).result(10)
    time.sleep(0.05)
    state = desk.live.newest.value
    assert state is not None
    with watching(page.address) as watcher:
        message = watcher.next()
    assert message.header["number"] == state.number
    height = state.reading[HeightMap].mm
    (described,) = message.header["maps"]
    np.testing.assert_allclose(
        message.map(described), height, atol=(height.max() - height.min()) / 65535
    )


def test_a_state_comes_only_when_the_page_has_shown_the_one_before(
    page: LivePage, desk: Desk
) -> None:
    with watching(page.address) as watcher:
        first = watcher.next(shown=False)
        measures_on(desk)
        with pytest.raises(TimeoutError):
            watcher.connection.recv(0.2)
        watcher.shown(first)
        second = watcher.next(shown=False)
    # no backlog: what was measured meanwhile is skipped, but its numbers are in the plots
    assert second.header["number"] >= first.header["number"] + 3
    rows = second.array(second.header["samples"]["rows"])
    assert len(rows) == second.header["number"] - first.header["number"]


def test_two_pages_watch_one_sensor(page: LivePage) -> None:
    with watching(page.address) as one, watching(page.address) as two:
        for _ in range(3):
            assert one.next().header["picture"]
            assert two.next().header["picture"]


def test_what_a_page_asks_for_is_answered_in_a_sentence(page: LivePage) -> None:
    with watching(page.address) as watcher:
        watcher.next()
        assert watcher.ask(do="tare")["done"].startswith("Tared")
        assert watcher.ask(do="reference", frames=2)["done"].startswith("Reference taken")
        assert "no virtual sensor" in watcher.ask(do="take", kind="coin", size_mm=3.0)["refused"]


@pytest.mark.parametrize(
    "words",
    [
        "no JSON",
        "[]",
        '{"do": "format_the_disk"}',
        '{"do": "tare", "path": "/etc/passwd"}',
        '{"do": "reference", "frames": 1000000}',
        '{"do": "play", "speed": -1}',
        '{"do": "play", "speed": NaN}',
        '{"do": "want", "maps": ["a", "b", "c", "d", "e", "f", "g", "h", "i"]}',
        '{"do": "move", "x_mm": "1", "y_mm": 0, "angle_deg": 0, "depth_mm": 0, "pressed": true}',
    ],
)
def test_an_unknown_command_is_refused_and_changes_nothing(page: LivePage, words: str) -> None:
    with watching(page.address) as watcher:
        watcher.connection.send(words)
        watcher.next()
        watcher.next()
        assert ["unknown command" in answer["refused"] for answer in watcher.answers] == [True]


def test_bytes_are_no_command(page: LivePage) -> None:
    with watching(page.address) as watcher:
        watcher.connection.send(b"\0" * 10)
        watcher.next()
        watcher.next()
        assert "not bytes" in watcher.answers[0]["refused"]


@pytest.mark.parametrize("path", ["", "style.css", "main.js", "sensors.json"])
def test_the_files_of_the_page_may_load_only_each_other(page: LivePage, path: str) -> None:
    status, headers, body = get(page, f"/{TOKEN}/{path}")
    assert (status, bool(body)) == (200, True)
    policy = headers["content-security-policy"]
    assert policy.startswith("default-src 'none'")
    assert "frame-ancestors 'none'" in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cache-control"] == "no-store"


@pytest.mark.parametrize(
    "path", ["/", "/style.css", "/wrong/", f"/{TOKEN[:-1]}/", f"//{TOKEN}/", "/%C3%A4/"]
)
def test_without_the_token_nothing_is_served(page: LivePage, path: str) -> None:
    status, _, body = get(page, path)
    assert status == 403
    assert TOKEN.encode() not in body


def test_without_the_token_no_websocket_opens(page: LivePage, desk: Desk) -> None:
    with pytest.raises(InvalidStatus) as refused:
        connect(f"ws://127.0.0.1:{page.port}/wrong/live/0")
    assert refused.value.response.status_code == 403
    measures_on(desk)


@pytest.mark.parametrize(
    "origin",
    ["https://evil.example", "null", "http://127.0.0.1:1", "http://localhost.evil.example"],
)
def test_a_page_of_another_origin_cannot_connect(page: LivePage, origin: str) -> None:
    with pytest.raises(InvalidStatus) as refused:
        connect(page.address.replace("http", "ws") + "live/0", origin=origin)  # type: ignore[arg-type]
    assert refused.value.response.status_code == 403
    assert get(page, f"/{TOKEN}/", Origin=origin)[0] == 403


def test_the_page_itself_can_connect(page: LivePage) -> None:
    origin = f"http://127.0.0.1:{page.port}"
    with connect(page.address.replace("http", "ws") + "live/0", origin=origin) as socket_:  # type: ignore[arg-type]
        assert "sensor" in json.loads(socket_.recv(10))


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", ""]
)
def test_a_name_that_was_pointed_to_this_machine_is_refused(page: LivePage, host: str) -> None:
    assert get(page, f"/{TOKEN}/", Host=host.format(port=page.port))[0] == 403


def test_localhost_is_another_name_of_it(page: LivePage) -> None:
    assert get(page, f"/{TOKEN}/", Host=f"localhost:{page.port}")[0] == 200


@pytest.mark.parametrize(
    "path",
    [
        "../../../etc/passwd",
        "..%2f..%2f..%2fetc%2fpasswd",
        "%2e%2e/%2e%2e/etc/passwd",
        "/etc/passwd",
        "page/../../server.py",
        "live/../style.css",
        "style.css/..",
        "style.css\\..\\..\\server.py",
        "index.html%00.css",
    ],
)
def test_no_path_leads_to_another_file(page: LivePage, path: str) -> None:
    assert get(page, f"/{TOKEN}/{path}")[0] == 404


@pytest.mark.parametrize("number", ["1", "-1", "00000", "9" * 50, "0/0", "%D9%A0"])
def test_there_are_no_other_sensors(page: LivePage, number: str) -> None:
    assert get(page, f"/{TOKEN}/live/{number}")[0] == 404


def raw_websocket(page: LivePage) -> socket.socket:
    """Open a websocket by hand, to send what no library sends."""
    raw = socket.create_connection(("127.0.0.1", page.port), timeout=10)
    raw.sendall(
        f"GET {urlsplit(page.address).path}live/0 HTTP/1.1\r\nHost: 127.0.0.1:{page.port}\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
    )
    assert b" 101 " in raw.recv(200)
    return raw


def send_a_gigabyte(raw: socket.socket) -> None:
    """Send what the header announced, and go on until nobody listens any more."""
    end_s = time.monotonic() + 30
    while time.monotonic() < end_s:
        raw.sendall(bytes(10**6))


def test_a_message_of_a_gigabyte_closes_its_connection_at_once(page: LivePage, desk: Desk) -> None:
    with raw_websocket(page) as raw:
        raw.sendall(b"\x81\xff" + struct.pack(">Q", 10**9) + b"\0\0\0\0")
        with pytest.raises(ConnectionError):
            send_a_gigabyte(raw)
    measures_on(desk)
    with watching(page.address) as watcher:
        assert watcher.next().header["picture"]


def test_a_request_without_end_is_dropped(page: LivePage, desk: Desk) -> None:
    with socket.create_connection(("127.0.0.1", page.port), timeout=10) as raw:
        with suppress(OSError):
            raw.sendall(b"GET /" + b"a" * 10_000_000)
        with suppress(ConnectionResetError):
            assert b" 200 " not in raw.recv(1000)
    measures_on(desk)


def test_a_connection_that_says_nothing_is_closed(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "_HANDSHAKE_S", 0.2)
    with (
        LivePage([desk], TOKEN) as page,
        socket.create_connection(("127.0.0.1", page.port), timeout=10) as raw,
    ):
        assert raw.recv(1) == b""


def test_two_hundred_connections_leave_room_for_the_user(page: LivePage, desk: Desk) -> None:
    with ExitStack() as stack:
        for _ in range(200):  # connections that say nothing
            stack.enter_context(socket.create_connection(("127.0.0.1", page.port), timeout=10))
        with watching(page.address) as watcher:
            assert watcher.next().header["picture"]
        measures_on(desk)


def test_more_pages_than_allowed_are_told_so(page: LivePage, desk: Desk) -> None:
    with ExitStack() as stack:
        for _ in range(server.BROWSERS):
            stack.enter_context(watching(page.address))
        refused = 0
        for _ in range(200 - server.BROWSERS):
            with pytest.raises(InvalidStatus) as error:
                connect(page.address.replace("http", "ws") + "live/0")
            refused += error.value.response.status_code == 503
        assert refused == 200 - server.BROWSERS
        measures_on(desk)
    until(lambda: not _is_full(page))


def _is_full(page: LivePage) -> bool:
    try:
        with watching(page.address) as watcher:
            watcher.next()
    except InvalidStatus:
        return True
    return False


def test_every_page_learns_what_one_of_them_has_changed(page: LivePage) -> None:
    with watching(page.address) as one, watching(page.address) as two:
        two.next(shown=False)  # its picture was encoded before the command
        assert one.ask(do="play", paused=True)["done"] == ""
        assert one.status["playback"]["paused"]
        two.say(do="shown", number=0)
        until(lambda: two.next() and two.status["playback"]["paused"])


def test_a_page_that_sends_commands_without_end_is_slowed_not_the_sensor(
    page: LivePage, desk: Desk
) -> None:
    with watching(page.address) as watcher:
        for _ in range(300):
            watcher.say(do="tare")
        measures_on(desk)


def test_a_page_that_vanishes_leaves_nothing_behind(page: LivePage, desk: Desk) -> None:
    raw_websocket(page).close()
    threads = threading.active_count()
    with watching(page.address) as watcher:
        watcher.next(shown=False)
        watcher.connection.socket.shutdown(socket.SHUT_RDWR)
    measures_on(desk)
    assert threading.active_count() <= threads + 2


def watch_for_ever(watcher: Watcher) -> None:
    while True:
        watcher.next()


def test_a_page_finds_a_restarted_server_at_the_same_address(desk: Desk) -> None:
    with LivePage([desk], TOKEN) as first, watching(first.address) as watcher:
        watcher.next()
        first.close()
        with pytest.raises(ConnectionClosed):
            watch_for_ever(watcher)
    with LivePage([desk], TOKEN, port=first.port) as second, watching(first.address) as watcher:
        assert second.address == first.address
        assert watcher.next().header["picture"]


def test_a_port_in_use_is_one_sentence(page: LivePage, desk: Desk) -> None:
    with pytest.raises(InputError, match=f"port {page.port} is in use.*--port"):
        LivePage([desk], TOKEN, port=page.port)


def test_an_address_of_another_computer_is_refused(desk: Desk) -> None:
    with pytest.raises(InputError, match=r"cannot be served on 192\.0\.2\.1"):
        LivePage([desk], TOKEN, host="192.0.2.1")


def test_every_address_at_once_is_refused(desk: Desk) -> None:
    with pytest.raises(InputError, match="every address"):
        LivePage([desk], TOKEN, host="0.0.0.0")


def test_it_listens_on_this_machine_only(page: LivePage) -> None:
    assert page.address.startswith("http://127.0.0.1:")
    others = [info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None)]
    for address in {one for one in others if isinstance(one, str) and not one.startswith("127.")}:
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection((address, page.port), timeout=1)


def test_what_goes_on_without_a_page_is_said(desk: Desk) -> None:
    pytest.importorskip("mcap", reason="the extra 'record' is not installed")
    said: list[str] = []
    with LivePage([desk], TOKEN, say=said.append) as page:
        with watching(page.address) as watcher:
            watcher.ask(do="tare")
        with watching(page.address) as watcher:
            watcher.ask(do="record", on=True)
        (sentence,) = until(lambda: said)
        assert "the recording of virtual_lab goes on" in sentence
        with watching(page.address) as watcher:
            assert watcher.hello["status"]["recording"] is not None
            assert "Recorded" in watcher.ask(do="record", on=False)["done"]


def rests(desk: Desk) -> bool:
    before = _number(desk)
    time.sleep(0.4)
    return _number(desk) == before


def test_a_virtual_sensor_waits_while_no_page_shows_it(virtual: Desk) -> None:
    with LivePage([virtual], TOKEN) as page:
        until(lambda: rests(virtual))
        with watching(page.address) as watcher:
            first, second = watcher.next(), watcher.next()
            assert second.header["number"] > first.header["number"]
        until(lambda: rests(virtual))


def test_a_virtual_sensor_that_is_recorded_goes_on_without_a_page(virtual: Desk) -> None:
    pytest.importorskip("mcap", reason="the extra 'record' is not installed")
    with LivePage([virtual], TOKEN) as page:
        with watching(page.address) as watcher:
            watcher.ask(do="record", on=True)
        time.sleep(0.4)  # the page has left
        measures_on(virtual)
        with watching(page.address) as watcher:
            assert "Recorded" in watcher.ask(do="record", on=False)["done"]
