"""Cameras on the network, against a server on this machine."""

from __future__ import annotations

import base64
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from support.mjpeg_server import BOUNDARY, Answer, Exchange, MjpegServer, jpeg

from tactile_core.builtin.cameras.stream_camera import StreamCamera, StreamOptions, VideoStream
from tactile_core.errors import CameraLost, CameraTimeout, DeviceBusy, DeviceError, InputError
from tactile_core.testing.imports import Footprint

PATIENCE_S = 20.0


@contextmanager
def streaming(answer: Answer, timeout_s: float = 20.0) -> Iterator[StreamCamera]:
    """Open a camera on a server's stream; nothing stays behind."""
    before = Footprint.take_snapshot()
    with MjpegServer(answer) as server:
        camera = StreamCamera(StreamOptions(url=server.url, timeout_s=timeout_s))
        camera.set_drop("never")
        with camera:
            yield camera
    assert before.find_leaks() == ""


def values(camera: StreamCamera, count: int) -> list[int]:
    images = [camera.read(PATIENCE_S) for _ in range(count)]
    return [round(float(image.pixels.mean())) for image in images if image is not None]


def after(*actions: Callable[[Exchange], None]) -> Answer:
    """Answer with one image, then these actions, then another image, then silence."""

    def answer(exchange: Exchange) -> None:
        exchange.begin()
        exchange.send_image(jpeg(10))
        for action in actions:
            action(exchange)
        exchange.send_image(jpeg(20))
        exchange.stall()

    return answer


def test_every_image_arrives_in_order_as_it_was_sent() -> None:
    sent = [jpeg(value) for value in range(0, 250, 10)]

    def answer(exchange: Exchange) -> None:
        exchange.begin()
        for data in sent:
            exchange.send_image(data)
        exchange.stall()

    with streaming(answer) as camera:
        images = [camera.read(PATIENCE_S) for _ in sent]
    assert [image.encoded for image in images if image] == sent
    assert [image.sequence for image in images if image] == list(range(len(sent)))
    times = [image.timestamp_s for image in images if image]
    assert times == sorted(set(times))
    first = images[0]
    assert first is not None
    assert first.pixels.shape == (48, 64, 3)
    assert abs(first.wall_time_s - time.time()) < PATIENCE_S


def test_colours_are_in_the_order_red_green_blue() -> None:
    import cv2

    red = np.zeros((16, 16, 3), np.uint8)
    red[..., 2] = 255  # OpenCV's order is blue, green, red
    with streaming(after(lambda e: e.send_image(bytes(cv2.imencode(".jpg", red)[1])))) as camera:
        camera.read(PATIENCE_S)
        image = camera.read(PATIENCE_S)
    assert image is not None
    assert image.pixels[8, 8, 0] > 240
    assert image.pixels[8, 8, 2] < 15


@pytest.mark.parametrize(
    "action",
    [
        lambda e: e.send(b"\r\n garbage \xff\xd8 between \r\n"),
        lambda e: e.send(b"--" + BOUNDARY.encode() + b"\r\n" + b"x" * 40_000),
    ],
    ids=["between parts", "instead of a header"],
)
def test_garbage_is_skipped(action: Callable[[Exchange], None]) -> None:
    with streaming(after(action)) as camera:
        assert values(camera, 2) == [10, 20]
        assert camera.statistics.torn == 0


@pytest.mark.parametrize(
    "action",
    [
        lambda e: e.send_image(jpeg(15)[:-40]),
        lambda e: e.send_image(jpeg(15)[:-40], length=len(jpeg(15))),
        lambda e: e.send_image(jpeg(15)[:100], length=None),
        lambda e: e.send_image(b"\xff\xd8\xff not a JPEG \xff\xd9"),
    ],
    ids=["no end", "too short for its length", "no length", "not an image"],
)
def test_a_torn_image_is_counted_and_the_next_one_read(action: Callable[[Exchange], None]) -> None:
    with streaming(after(action)) as camera:
        assert values(camera, 2) == [10, 20]
        assert camera.statistics.torn == 1


def test_lengths_are_not_needed() -> None:
    with streaming(after(lambda e: e.send_image(jpeg(15), length=None))) as camera:
        assert values(camera, 3) == [10, 15, 20]


def test_an_image_that_the_server_sends_again_is_left_out() -> None:
    actions = [
        lambda e, stamp=stamp: e.send_image(jpeg(15), X_Timestamp=stamp)
        for stamp in ("1.0", "1.0", "1.0", "2.0")
    ]
    with streaming(after(*actions)) as camera:
        assert values(camera, 4) == [10, 15, 15, 20]
        assert camera.statistics.repeated == 3


def test_a_stall_times_out_and_the_stream_goes_on() -> None:
    resumed = threading.Event()
    with streaming(after(lambda e: resumed.wait(PATIENCE_S) and None)) as camera:
        assert values(camera, 1) == [10]
        with pytest.raises(CameraTimeout, match=r"stream\?view=0 sent no image within 0.05 s"):
            camera.read(0.05)
        resumed.set()
        assert values(camera, 1) == [20]


def test_silence_for_longer_than_the_limit_is_a_lost_camera() -> None:
    with streaming(after(Exchange.stall), timeout_s=0.2) as camera:
        assert values(camera, 1) == [10]
        with pytest.raises(
            CameraLost, match=r"has sent nothing for 0.2 s; check the camera's host"
        ):
            camera.read(PATIENCE_S)


def test_a_slow_start_is_awaited() -> None:
    def answer(exchange: Exchange) -> None:
        time.sleep(0.2)
        exchange.begin()
        time.sleep(0.2)
        exchange.send_image(jpeg(30))
        exchange.stall()

    with streaming(answer) as camera:
        assert values(camera, 1) == [30]


def test_a_stream_that_ends_is_a_lost_camera_and_can_be_reopened() -> None:
    def answer(exchange: Exchange) -> None:
        exchange.begin()
        exchange.send_image(jpeg(40))

    before = Footprint.take_snapshot()
    with MjpegServer(answer) as server:
        camera = StreamCamera(StreamOptions(url=server.url))
        for _ in range(2):
            with camera:
                assert values(camera, 1) == [40]
                with pytest.raises(CameraLost, match="ended the stream"):
                    camera.read(PATIENCE_S)
    assert before.find_leaks() == ""


def test_a_closed_connection_in_the_middle_of_an_image_is_a_lost_camera() -> None:
    def answer(exchange: Exchange) -> None:
        exchange.begin()
        exchange.send(b"--frame\r\nContent-Length: 5000\r\n\r\n" + jpeg(1)[:300])

    with streaming(answer) as camera, pytest.raises(CameraLost):
        camera.read(PATIENCE_S)


def test_closing_does_not_wait_for_a_silent_server() -> None:
    def answer(exchange: Exchange) -> None:
        exchange.begin()
        exchange.stall()

    with streaming(answer) as camera:
        began = time.monotonic()
        camera.close()
        assert time.monotonic() - began < 10


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda e: e.fail(404), r"there is nothing at http://.*/stream.*; correct 'camera.url'"),
        (lambda e: e.fail(401), r"wants a user and a password; write http://user:password@"),
        (lambda e: e.fail(503), r"answers 503 Service Unavailable"),
        (lambda e: e.fail(301, Location="/cam1"), r"has moved to /cam1"),
        (lambda e: e.begin("text/html"), r"sends text/html, not a stream of images"),
        (lambda e: e.begin("image/jpeg"), r"sends image/jpeg, not a stream of images"),
        (lambda e: e.begin("multipart/x-mixed-replace"), r"not a stream of images"),
        (lambda e: e.stall(), r"does not answer within 0.3 s"),
        (lambda e: None, r"does not answer as a web server does"),
    ],
    ids=["404", "401", "503", "301", "page", "snapshot", "no boundary", "silence", "hang-up"],
)
def test_an_answer_that_is_no_stream_is_explained_in_one_sentence(
    answer: Answer, message: str
) -> None:
    before = Footprint.take_snapshot()
    with MjpegServer(answer) as server, pytest.raises(DeviceError, match=message):
        StreamCamera(StreamOptions(url=server.url, timeout_s=0.3)).open()
    assert before.find_leaks() == ""


def test_a_port_where_nothing_listens_refuses_the_connection() -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
    with pytest.raises(DeviceError, match=r"refuses the connection; start the program"):
        StreamCamera(StreamOptions(url=f"http://127.0.0.1:{port}/")).open()


@pytest.mark.parametrize(
    "url",
    [
        "",
        "camera",
        "file:///etc/passwd",
        "http://",
        "http://[::1",
        "http://host:99999/",
        "ftp://a/b",
    ],
)
def test_what_is_no_address_of_a_stream_is_refused(url: str) -> None:
    with pytest.raises(InputError, match=r"is no address of a stream; write http://host:port/path"):
        StreamCamera(StreamOptions(url=url)).open()


def test_without_an_address_the_error_names_the_option() -> None:
    with pytest.raises(InputError, match=r"core\.stream has no address"):
        StreamCamera(StreamOptions()).open()


def test_user_and_password_are_sent_and_never_shown() -> None:
    seen: list[str | None] = []

    def answer(exchange: Exchange) -> None:
        seen.append(exchange.headers["Authorization"])
        exchange.fail(404)

    with MjpegServer(answer) as server:
        url = server.url.replace("http://", "http://me:se%20cret@")
        camera = StreamCamera(StreamOptions(url=url))
        with pytest.raises(DeviceError) as caught:
            camera.open()
    assert seen == ["Basic " + base64.b64encode(b"me:se cret").decode()]
    assert "cret" not in str(caught.value)
    assert "cret" not in camera.device_id


def test_a_secret_in_the_query_is_sent_and_never_shown() -> None:
    seen: list[str] = []

    def answer(exchange: Exchange) -> None:
        seen.append(exchange.path)
        exchange.fail(404)

    with MjpegServer(answer) as server:
        camera = StreamCamera(StreamOptions(url=f"{server.url}&channel=1&token=secret"))
        with pytest.raises(DeviceError, match=r"nothing at .*channel=1; correct") as caught:
            camera.open()
        with pytest.raises(DeviceError, match=r"write it as %20") as of_space:
            StreamCamera(StreamOptions(url=f"{server.url}&token=se cret")).open()
    assert seen == ["/stream?view=0&channel=1&token=secret"]
    assert "cret" not in f"{caught.value} {of_space.value} {camera.device_id}"


def test_one_stream_is_opened_once_in_a_process() -> None:
    with streaming(after(Exchange.stall)) as camera, pytest.raises(DeviceBusy):
        StreamCamera(StreamOptions(url=camera.options.model_dump()["url"])).open()


def test_an_rtsp_address_where_nothing_listens_is_refused() -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
    with pytest.raises(DeviceError, match=r"rtsp://127.0.0.1:\d+/live sends no video"):
        StreamCamera(StreamOptions(url=f"rtsp://127.0.0.1:{port}/live", timeout_s=1)).open()


def test_an_rtsp_server_that_never_answers_is_given_up() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"rtsp://127.0.0.1:{silent.getsockname()[1]}/live"
        with pytest.raises(DeviceError, match=r"or not within 0.3 s; check the address"):
            StreamCamera(StreamOptions(url=url, timeout_s=0.3)).open()


def test_what_ffmpeg_reads_is_delivered_until_it_ends() -> None:
    def answer(exchange: Exchange) -> None:
        exchange.begin()
        for value in range(0, 200, 10):
            exchange.send_image(jpeg(value))

    with MjpegServer(answer) as server:
        source = VideoStream(server.url, "the video", 5.0)
        images = [source.grab() for _ in range(18)]
        with pytest.raises(CameraLost, match="the video ended"):
            [source.grab() for _ in range(18)]
        source.close()
    assert all(image is not None and image.pixels.shape == (48, 64, 3) for image in images)
