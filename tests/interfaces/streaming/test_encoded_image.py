"""Compressed images: decoded when they are read, once, and counted as torn if that fails."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tactile_core.errors import CameraTimeout
from tactile_core.interfaces.streaming import encoded_image
from tactile_core.interfaces.streaming.encoded_image import EncodedImage, TornImage
from tactile_core.interfaces.streaming.image_queue import ImageQueue, QueueParameters

PATIENCE_S = 10.0


def jpeg(number: int) -> bytes:
    return bytes(cv2.imencode(".jpg", np.full((16, 24, 3), number, np.uint8))[1])


def sent(number: int, data: bytes | None = None) -> EncodedImage:
    given = jpeg(number) if data is None else data
    return encoded_image.encoded_image(given, 1.0 + number, "a camera", gain=2.0)


def undecodable(number: int) -> EncodedImage:
    """Complete, with a size but without any tables."""
    bare = bytes.fromhex("ffd8 ffc0000b08001000180101 1100 ffda000801010000 3f00 1234 ffd9")
    return sent(number, bare)


@pytest.fixture
def decoded(monkeypatch: pytest.MonkeyPatch) -> list[bytes]:
    """What is decoded, in order."""
    data: list[bytes] = []
    proper = encoded_image.decode_image

    def noted(given: bytes, name: str) -> object:
        data.append(given)
        return proper(given, name)

    monkeypatch.setattr(encoded_image, "decode_image", noted)
    return data


def test_an_image_keeps_its_bytes_time_and_settings() -> None:
    queue = ImageQueue("a camera")
    queue.put(sent(7))
    image = queue.next(0)
    assert image is not None
    assert image.encoded == jpeg(7)
    assert (image.timestamp_s, image.sequence, image.gain) == (8.0, 0, 2.0)
    assert image.pixels.shape == (16, 24, 3)
    assert np.abs(image.pixels.astype(int) - 7).max() <= 2


def test_images_that_nobody_reads_are_not_decoded(decoded: list[bytes]) -> None:
    queue = ImageQueue("a camera", "oldest")
    for number in range(10):
        queue.put(sent(number))
    assert queue.next(0) is not None
    assert decoded == [jpeg(9)]
    assert queue.statistics.dropped == 9


def test_the_latest_image_is_decoded_once(decoded: list[bytes]) -> None:
    queue = ImageQueue("a camera", clock=lambda: 1.0)
    queue.put(sent(0))
    assert queue.latest(1.0) is queue.latest(1.0)
    assert decoded == [jpeg(0)]


@pytest.mark.parametrize("data", [b"", b"GET / HTTP", jpeg(1)[:-20]], ids=["none", "text", "half"])
def test_an_incomplete_image_is_refused_without_decoding(data: bytes, decoded: list[bytes]) -> None:
    with pytest.raises(TornImage, match="a camera sent an incomplete image"):
        sent(0, data)
    assert decoded == []


def test_an_image_that_cannot_be_decoded_is_torn_once_it_is_read() -> None:
    queue = ImageQueue("a camera", "never", clock=lambda: 3.0)
    queue.put(undecodable(0))
    queue.put(sent(1))
    queue.put(undecodable(2))
    image = queue.next(PATIENCE_S)
    assert image is not None
    assert image.sequence == 1
    with pytest.raises(CameraTimeout, match="2 came torn"):
        queue.latest(0.01)
    with pytest.raises(CameraTimeout, match="2 came torn"):
        queue.next(0.01)
    assert (queue.statistics.received, queue.statistics.torn) == (1, 2)


def test_compressed_images_wait_in_the_memory_that_they_take() -> None:
    one = len(jpeg(1))
    queue = ImageQueue("a camera", "never", QueueParameters(never_bytes=3 * one))
    for number in (1, 2, 3):
        assert queue.has_room()
        queue.put(sent(number, jpeg(1)))
    assert not queue.has_room()
    assert queue.next(0) is not None
    assert queue.has_room()
