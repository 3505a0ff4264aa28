"""Parses the headers of image files, to reject oversized and torn ones before decoding.

Supported formats: PNG, JPEG, BMP, TIFF, WebP, PGM and PPM. Pillow opens these lazily too, but
hides the 16 bits of a colour PNG, warns about large images, and finds truncation only by decoding.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import takewhile

_PNG = b"\x89PNG\r\n\x1a\n"  # First bytes of a PNG

# Channels by the colour type of a PNG; alpha does not count, a palette counts as RGB.
_PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 1, 6: 3}

_JPEG = b"\xff\xd8\xff"  # First bytes of a JPEG

_SOS = 0xDA  # JPEG marker before the compressed data ("start of scan")

_PNM = re.compile(rb"P[1-6](?:\s+(?:#[^\n]*\n\s*)*(\d{1,9}))(?:\s+(?:#[^\n]*\n\s*)*(\d{1,9}))")
"""Header of a PGM or PPM, with comments: width and height."""

# Byte order by the first bytes of a TIFF, as struct writes it.
_TIFF_ORDERS = {b"II*\0": "<", b"MM\0*": ">"}

_TIFF_TYPES = {3: "H", 4: "I"}  # Integer types of TIFF fields, as struct writes them

_WIDTH, _HEIGHT = 256, 257  # Tags of the TIFF fields that are read


@dataclass(frozen=True)
class Header:
    """Content of an image file's header.

    Attributes
    ----------
    width_px, height_px : int
    channels, bits : int
        Of a PNG or JPEG: 1 for grey or 3 for colour, and 8 or 16 bits. 0 for other formats, whose
        pixels must be decoded to find out.
    frames : int
        Number of images in the file; 2 means two or more.
    """

    width_px: int
    height_px: int
    channels: int = 0
    bits: int = 0
    frames: int = 1


def header(data: bytes) -> Header | None:
    """Parse a header; return None if it is not an image's header or is incomplete."""
    if data.startswith(_PNG):
        return _png(data)
    if data.startswith(_JPEG):
        return _jpeg(data)
    try:
        if data.startswith(b"BM"):
            old = struct.unpack_from("<I", data, 14) == (12,)
            width, height = struct.unpack_from("<HH" if old else "<ii", data, 18)
            return Header(width, abs(height))
        if data[:4] in _TIFF_ORDERS:
            return _tiff(data)
        if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
            return _webp(data)
    except struct.error:
        return None
    pnm = _PNM.match(data[:4096])
    return None if pnm is None else Header(int(pnm[1]), int(pnm[2]))


def kind_of(data: bytes) -> str | None:
    """Return the format of an image's content: png, jpeg, bmp, tiff, webp, pgm or ppm."""
    starts = {_PNG: "png", _JPEG: "jpeg", b"BM": "bmp", b"P5": "pgm", b"P6": "ppm"}
    starts |= dict.fromkeys(_TIFF_ORDERS, "tiff")
    if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        return "webp"
    return next((kind for start, kind in starts.items() if data.startswith(start)), None)


def is_torn(data: bytes) -> bool:
    """Whether the end of a JPEG is missing, which decoders fill in with grey.

    Of every other format, OpenCV decodes nothing that is truncated.
    """
    if not data.startswith(_JPEG):
        return False
    scan = next((at for marker, at in _jpeg_segments(data) if marker == _SOS), None)
    # compressed data cannot contain an end marker: a zero byte follows each 0xFF in it
    return scan is None or data.find(b"\xff\xd9", scan) < 0


def _png(data: bytes) -> Header | None:
    if len(data) < 26 or data[12:16] != b"IHDR":
        return None
    width, height = struct.unpack_from(">II", data, 16)
    chunks = (name for name, _, _ in _png_chunks(memoryview(data)))
    # an animation declares itself before its first image
    frames = 2 if b"acTL" in takewhile(lambda name: name != b"IDAT", chunks) else 1
    return Header(width, height, _PNG_CHANNELS.get(data[25], 3), max(8, data[24]), frames)


def _png_chunks(data: memoryview) -> Iterator[tuple[bytes, int, int]]:
    """Yield each chunk's name, its offset and the offset of its content's end."""
    at = len(_PNG)
    while at + 12 <= len(data):
        end = at + 8 + int.from_bytes(data[at : at + 4], "big")
        yield bytes(data[at + 4 : at + 8]), at, end
        at = end + 4


def _jpeg(data: bytes) -> Header | None:
    for marker, at in _jpeg_segments(data):
        starts_frame = marker & 0xF0 == 0xC0 and marker not in (0xC4, 0xC8, 0xCC)
        if starts_frame and at + 10 <= len(data):
            height, width = struct.unpack_from(">HH", data, at + 5)
            return Header(width, height, 1 if data[at + 9] == 1 else 3, 8)
    return None


def _jpeg_segments(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield (marker, offset of the marker) of each segment up to the compressed data."""
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF:  # padding
            at += 1
            continue
        yield marker, at
        if marker == _SOS:
            return
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")


def _webp(data: bytes) -> Header | None:
    kind = data[12:16]
    if kind == b"VP8X":
        width, height = (int.from_bytes(data[i : i + 3], "little") + 1 for i in (24, 27))
        return Header(width, height, frames=2 if data[20] & 2 else 1)
    if kind == b"VP8L":
        (sizes,) = struct.unpack_from("<I", data, 21)
        return Header((sizes & 0x3FFF) + 1, (sizes >> 14 & 0x3FFF) + 1)
    if kind == b"VP8 ":
        width, height = struct.unpack_from("<HH", data, 26)
        return Header(width & 0x3FFF, height & 0x3FFF)
    return None


def _tiff(data: bytes) -> Header | None:
    fields, following = _tiff_fields(data)
    width, height = fields.get(_WIDTH), fields.get(_HEIGHT)
    if not width or not height:
        return None
    return Header(width[0], height[0], frames=2 if following else 1)


def without_orientation(data: bytes) -> bytes:
    """Return an image file without the tag by which OpenCV turns a TIFF, whatever its flags."""
    order = _TIFF_ORDERS.get(data[:4])
    if order is None:
        return data
    changed = bytearray(data)
    for entry in _tiff_entries(data):
        if struct.unpack_from(f"{order}HH", data, entry) == (274, 3):  # tag: how to turn the image
            struct.pack_into(f"{order}H", changed, entry + 8, 1)
    return bytes(changed)


def _tiff_entries(data: bytes) -> range:
    """Return the places of the first image's fields; they end where the next image is named."""
    order = _TIFF_ORDERS[data[:4]]
    (at,) = struct.unpack_from(f"{order}I", data, 4)
    (count,) = struct.unpack_from(f"{order}H", data, at)
    return range(at + 2, at + 2 + 12 * count, 12)


def _tiff_fields(data: bytes) -> tuple[dict[int, tuple[int, ...]], int]:
    """Return the integer fields of the first image by tag, and the offset of the next image."""
    order, entries = _TIFF_ORDERS[data[:4]], _tiff_entries(data)
    fields: dict[int, tuple[int, ...]] = {}
    for entry in entries:
        tag, kind, length = struct.unpack_from(f"{order}HHI", data, entry)
        if tag not in {_WIDTH, _HEIGHT} - fields.keys() or kind not in _TIFF_TYPES:
            continue
        if 2 * length > len(data):
            raise struct.error("more values than the file has room for")
        values = f"{order}{length}{_TIFF_TYPES[kind]}"
        place = entry + 8
        if struct.calcsize(values) > 4:
            (place,) = struct.unpack_from(f"{order}I", data, place)
        fields[tag] = struct.unpack_from(values, data, place)
    (following,) = struct.unpack_from(f"{order}I", data, entries.stop)
    return fields, following
