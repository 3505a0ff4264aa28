"""JPEG images in a multipart stream, however it is cut, damaged or written."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support.mjpeg_server import jpeg

from tactile_core.formats import video
from tactile_core.formats.video import MjpegParser

IMAGES = [jpeg(value, (4, 5)) for value in (0, 90, 200)]


def stream(
    images: list[bytes], *, lengths: bool = True, newline: bytes = b"\r\n", garbage: bytes = b""
) -> bytes:
    data = b""
    for image in images:
        head = [b"--frame", b"Content-Type: image/jpeg"]
        if lengths:
            head.append(b"content-length: %d" % len(image))
        data += newline.join([*head, b"", b""]) + image + newline + garbage
    return data


def bodies(parser: MjpegParser, data: bytes, cuts: Sequence[int] = ()) -> list[bytes]:
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    parts = [parser.feed(data[a:b]) for a, b in pairwise(edges)]
    return [part.body for several in parts for part in several]


@example([len(stream(IMAGES[:1], lengths=False)) + 5], False, b"\r\n", b"\r\n")  # in a boundary
@given(
    st.lists(st.integers(0, 10_000), max_size=12),
    st.booleans(),
    st.sampled_from([b"\r\n", b"\n"]),
    st.sampled_from([b"", b"\r\n", b"noise \xff\xd8\xff\xd9 noise"]),
)
def test_images_are_the_same_wherever_the_stream_is_cut(
    cuts: list[int], lengths: bool, newline: bytes, garbage: bytes
) -> None:
    data = stream(IMAGES, lengths=lengths, newline=newline, garbage=garbage)
    found = bodies(MjpegParser("frame"), data, cuts)
    # without a length, garbage after an image can only be distinguished by decoding it
    assert [body[: len(image)] for body, image in zip(found, IMAGES, strict=True)] == IMAGES
    assert found == IMAGES or (garbage.startswith(b"noise") and not lengths)


@given(st.binary(max_size=300), st.lists(st.integers(0, 1000), max_size=5))
def test_whatever_came_before_the_next_images_are_found(junk: bytes, cuts: list[int]) -> None:
    found = bodies(MjpegParser("frame"), junk + b"\n" + stream(IMAGES), cuts)
    assert found[-3:] == IMAGES


@pytest.mark.parametrize("declared", ["frame", "--frame", "----frame"])
def test_servers_disagree_about_the_dashes_of_the_boundary(declared: str) -> None:
    assert bodies(MjpegParser(declared), stream(IMAGES)) == IMAGES


def test_an_image_without_a_length_does_not_wait_for_the_next_one() -> None:
    data = stream(IMAGES[:1], lengths=False)
    at_end = data.index(IMAGES[0]) + len(IMAGES[0])
    parser = MjpegParser("frame")
    assert parser.feed(data[: at_end - 1]) == []
    assert [part.body for part in parser.feed(data[at_end - 1 : at_end])] == IMAGES[:1]


@pytest.mark.parametrize("stated", [1, 10**5, 10**15, -4], ids=["short", "long", "vast", "minus"])
def test_a_wrong_length_damages_one_image_at_most(stated: int) -> None:
    head = b"--frame\r\nContent-Length: %d\r\n\r\n" % stated
    found = bodies(MjpegParser("frame"), head + IMAGES[0] + b"\r\n" + stream(IMAGES[1:]))
    assert found[-2:] == IMAGES[1:]


def test_a_torn_image_is_handed_on_and_the_next_one_found() -> None:
    torn = stream(IMAGES[:1])[:-200]
    found = bodies(MjpegParser("frame"), torn + b"\r\n" + stream(IMAGES[1:]))
    assert IMAGES[0].startswith(found[0])
    assert found[1:] == IMAGES[1:]


def test_the_headers_of_an_image_are_kept() -> None:
    (part,) = MjpegParser("x").feed(b"--x\r\nX-Timestamp: 12.5\r\nContent-Length: 2\r\n\r\nab")
    assert part.headers == {"x-timestamp": "12.5", "content-length": "2"}
    assert part.body == b"ab"


def test_the_end_of_a_stream_is_no_image() -> None:
    assert bodies(MjpegParser("frame"), stream(IMAGES) + b"--frame--\r\n") == IMAGES


def test_memory_stays_bounded_without_any_boundary(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(video, "MAX_PART_BYTES", 1000)
    parser = MjpegParser("frame")
    for _ in range(100):
        parser.feed(b"x" * 100)
    assert len(parser._buffer) < 100
    parser.feed(b"--frame\r\n")
    for _ in range(1000):
        parser.feed(b"y" * 100)
    assert len(parser._buffer) < 1000
    parser.feed(b"--frame\r\n\r\n")
    for _ in range(100):
        parser.feed(b"z" * 100)
    assert len(parser._buffer) < 1200
