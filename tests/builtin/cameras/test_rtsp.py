"""``core.stream`` and a real RTSP server."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from support.rtsp_server import BLUE, ENCODERS, GREEN, HEIGHT, RED, WIDTH, RtspServer, missing

from tactile_core.builtin.cameras.stream_camera import StreamCamera, StreamOptions
from tactile_core.errors import CameraLost, DeviceError
from tactile_core.testing.imports import Footprint

pytestmark = pytest.mark.skipif(bool(missing()), reason=f"needs: apt install {missing()}")

PATIENCE_S = 20.0
RANGE = 15
"""Grey levels; GStreamer writes limited-range colours into a JPEG, which has the full range."""


def camera_at(url: str, timeout_s: float = PATIENCE_S) -> StreamCamera:
    return StreamCamera(StreamOptions(url=url, timeout_s=timeout_s))


@pytest.mark.parametrize("encoding", ENCODERS)
def test_images_have_the_size_and_the_colours_of_the_stream(encoding: str) -> None:
    with RtspServer(encoding) as server, camera_at(server.url) as camera:
        images = [camera.read(PATIENCE_S) for _ in range(5)]
    stamps_s = [image.timestamp_s for image in images if image]
    assert stamps_s == sorted(set(stamps_s))
    for image in images:
        assert image is not None
        assert image.pixels.shape == (HEIGHT, WIDTH, 3)
        np.testing.assert_allclose(image.pixels.mean(axis=(0, 1)), (RED, GREEN, BLUE), atol=RANGE)


def test_a_path_without_a_stream_is_an_error() -> None:
    with RtspServer() as server, pytest.raises(DeviceError, match="sends no video, or not within"):
        camera_at(server.url.replace("live", "other")).open()


@pytest.mark.parametrize("ends", [RtspServer.kill, RtspServer.pause])
def test_a_server_that_ends_or_falls_silent_is_a_lost_camera(
    ends: Callable[[RtspServer], None],
) -> None:
    with RtspServer() as server, camera_at(server.url, timeout_s=2.0) as camera:
        assert camera.read(PATIENCE_S) is not None
        ends(server)
        with pytest.raises(CameraLost, match="ended or sends nothing; check the camera's host"):
            [camera.read(PATIENCE_S) for _ in range(10_000)]


def test_a_stream_that_is_opened_again_leaves_nothing() -> None:
    with RtspServer() as server:
        camera = camera_at(server.url)
        with camera:
            camera.read(PATIENCE_S)
        before = Footprint.take_snapshot()
        with camera:
            assert camera.read(PATIENCE_S) is not None
        assert before.find_leaks() == ""
