"""Mutations of images: other sizes, depths and formats, and false headers."""

from __future__ import annotations

import struct
import zlib
from random import Random

import cv2
import numpy as np
from numpy.typing import NDArray

_SUFFIXES = (".png", ".jpg", ".bmp", ".tiff", ".webp", ".ppm", ".pgm")


def corrupted_image(data: bytes, rng: Random) -> bytes:
    """Return the image in another format or with changed pixels or headers."""
    if rng.random() < 0.3:
        return _header_changed(data, rng)
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    if pixels is None:
        return rng.choice((_GIF, b"", b"II*\x00\xff\xff\xff\xff", data[:-7]))
    if rng.random() < 0.1:
        return rng.choice((_GIF, _many_pages(pixels), _png(0, 0), _png(32766, 32766)))
    suffix = rng.choice(_SUFFIXES) if rng.random() < 0.4 else ".png"
    return _encoded(_changed(pixels, rng), suffix)


def _changed(pixels: NDArray[np.uint8], rng: Random) -> NDArray[np.uint8]:
    height, width = pixels.shape[:2]
    kind = rng.randrange(12)
    if kind == 0:
        size = (rng.choice((1, 2, 8, width - 1, 2 * width, 700)), rng.choice((1, 3, height, 500)))
        return np.asarray(cv2.resize(pixels, size), np.uint8)
    if kind == 1:
        return pixels.astype(np.uint16) * 257  # type: ignore[return-value]
    if kind == 2:
        return pixels.astype(np.float32)  # type: ignore[return-value]
    if kind == 3:
        return np.full_like(pixels, rng.choice((0, 1, 128, 254, 255)))
    if kind == 4:
        return pixels[..., 0] if pixels.ndim == 3 else np.dstack(3 * [pixels])
    if kind == 5:
        alpha = np.full(pixels.shape[:2], rng.choice((0, 128, 255)), np.uint8)
        return np.dstack([pixels, alpha]) if pixels.ndim == 3 else pixels
    if kind == 6:
        return np.ascontiguousarray(pixels[::-1, ::-1])
    if kind == 7:
        return np.ascontiguousarray(np.swapaxes(pixels, 0, 1))
    if kind == 8:
        return np.where(pixels > rng.randrange(1, 255), 255, 0).astype(np.uint8)
    if kind == 9:
        noise = np.random.default_rng(rng.randrange(2**32)).integers(0, 256, pixels.shape)
        return noise.astype(np.uint8)
    if kind == 10:
        return 255 - pixels
    return (pixels * rng.choice((0.02, 0.3, 3.0))).clip(0, 255).astype(np.uint8)


def _encoded(pixels: NDArray[np.uint8], suffix: str) -> bytes:
    try:
        return bytes(cv2.imencode(suffix, pixels)[1])
    except cv2.error:
        return bytes(cv2.imencode(".png", pixels.astype(np.uint8))[1])


def _many_pages(pixels: NDArray[np.uint8]) -> bytes:
    return bytes(cv2.imencodemulti(".tiff", [pixels, pixels])[1])


def _header_changed(data: bytes, rng: Random) -> bytes:
    """Return a PNG with a changed header and the matching checksum."""
    if not data.startswith(b"\x89PNG") or len(data) < 33:
        return data[: rng.randrange(len(data) + 1)]
    head = bytearray(data[12:29])
    if rng.random() < 0.6:
        side = rng.choice((0, 1, 79, 81, 4097, 32766, 2**31 - 1, 2**32 - 1))
        struct.pack_into(">I", head, rng.choice((4, 8)), side)
    else:
        head[rng.randrange(12, 17)] = rng.choice((0, 1, 2, 3, 4, 6, 7, 16, 255))
    check = struct.pack(">I", zlib.crc32(head))
    return data[:12] + bytes(head) + check + data[33:]


def _png(width: int, height: int) -> bytes:
    """Return a black, grey PNG of any size, which is about 1000 times smaller on disk."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(kind + content))
        return struct.pack(">I", len(content)) + kind + content + check

    packer = zlib.compressobj(1)
    rows = [packer.compress(bytes(width + 1)) for _ in range(min(height, 300))] + [packer.flush()]
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", b"".join(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


_FRAME = (
    b"\x21\xf9\x04\x00\x0a\x00\x00\x00\x2c\x00\x00\x00\x00\x01\x00\x01\x00\x00\x02\x02\x44\x01\x00"
)
_GIF = b"GIF89a\x01\x00\x01\x00\x80\x00\x00\x00\x00\x00\xff\xff\xff" + _FRAME + _FRAME + b"\x3b"
"""A GIF with two frames."""
