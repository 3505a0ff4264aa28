"""What the header of an image file says, so that nothing is decoded which is too large or torn.

Only these formats are read: PNG, JPEG, BMP, TIFF, WebP, PGM and PPM.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import takewhile

MOST_PIXELS = 50_000_000
"""Of one image: the cameras of such sensors have 20 megapixels at most, and measuring takes some
fifty bytes for each."""

_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 1, 6: 3}
_JPEG = b"\xff\xd8\xff"
_SOF = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_SOS = 0xDA
_PNM = re.compile(rb"P[1-6](?:\s+(?:#[^\n]*\n\s*)*(\d{1,9}))(?:\s+(?:#[^\n]*\n\s*)*(\d{1,9}))")
_TIFF_ORDERS = {b"II*\0": "<", b"MM\0*": ">"}
_TIFF_TYPES = {3: "H", 4: "I"}
_WIDTH, _HEIGHT, _STRIPS, _STRIP_BYTES, _TILES, _TILE_BYTES = 256, 257, 273, 279, 324, 325
_TIFF_TAGS = frozenset({_WIDTH, _HEIGHT, _STRIPS, _STRIP_BYTES, _TILES, _TILE_BYTES})


@dataclass(frozen=True)
class Header:
    """What a header says of its image.

    Attributes
    ----------
    width_px, height_px : int
    channels, bits : int
        Of a PNG or JPEG: 1 for grey and 3 for colour, 8 or 16; 0 where only the pixels show it.
    frames : int
        Pictures in the file; 2 stands for any number above 1.
    """

    width_px: int
    height_px: int
    channels: int = 0
    bits: int = 0
    frames: int = 1


def header(data: bytes) -> Header | None:
    """Return what the header says; None where it is not that of an image, or beyond the data."""
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


def is_whole(data: bytes) -> bool:
    """Whether all that the header promises is there, and where there are checksums, unharmed."""
    try:
        if data.startswith(_PNG):
            return _whole_png(memoryview(data))
        if data.startswith(_JPEG):
            scan = next((at for marker, at in _jpeg_segments(data) if marker == _SOS), None)
            # within the coded data a true end marker cannot occur by chance: 0xFF is stuffed there
            return scan is not None and data.find(b"\xff\xd9", scan) >= 0
        if data.startswith(b"BM"):
            return len(data) >= int.from_bytes(data[2:6], "little")
        if data.startswith(b"RIFF"):
            return len(data) >= 8 + int.from_bytes(data[4:8], "little")
        if data[:4] in _TIFF_ORDERS:
            return _whole_tiff(data)
    except struct.error:
        return False
    return True


def _png(data: bytes) -> Header | None:
    if len(data) < 26 or data[12:16] != b"IHDR":
        return None
    width, height = struct.unpack_from(">II", data, 16)
    chunks = (name for name, _, _ in _png_chunks(memoryview(data)))
    # an animation says so before its first picture
    frames = 2 if b"acTL" in takewhile(lambda name: name != b"IDAT", chunks) else 1
    return Header(width, height, _PNG_CHANNELS.get(data[25], 3), max(8, data[24]), frames)


def _png_chunks(data: memoryview) -> Iterator[tuple[bytes, int, int]]:
    """Name of each chunk, where it begins and where its content ends."""
    at = len(_PNG)
    while at + 12 <= len(data):
        end = at + 8 + int.from_bytes(data[at : at + 4], "big")
        yield bytes(data[at + 4 : at + 8]), at, end
        at = end + 4


def _whole_png(data: memoryview) -> bool:
    for name, at, end in _png_chunks(data):
        if end + 4 > len(data) or zlib.crc32(data[at + 4 : end]) != int.from_bytes(
            data[end : end + 4], "big"
        ):
            return False
        if name == b"IEND":
            return True
    return False


def _jpeg(data: bytes) -> Header | None:
    for marker, at in _jpeg_segments(data):
        if marker in _SOF and at + 10 <= len(data):
            height, width = struct.unpack_from(">HH", data, at + 5)
            return Header(width, height, 1 if data[at + 9] == 1 else 3, 8)
    return None


def _jpeg_segments(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield (marker, offset of the marker) of each segment up to the coded data."""
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


def _whole_tiff(data: bytes) -> bool:
    fields, _ = _tiff_fields(data)
    ends = []
    for places, counts in ((_STRIPS, _STRIP_BYTES), (_TILES, _TILE_BYTES)):
        pairs = zip(fields.get(places, ()), fields.get(counts, ()), strict=False)
        ends += [place + count for place, count in pairs]
    return bool(ends) and max(ends) <= len(data)


def _tiff_fields(data: bytes) -> tuple[dict[int, tuple[int, ...]], int]:
    """Whole numbers of the first picture's directory by tag, and where the next picture's is."""
    order = _TIFF_ORDERS[data[:4]]
    (at,) = struct.unpack_from(f"{order}I", data, 4)
    (count,) = struct.unpack_from(f"{order}H", data, at)
    fields: dict[int, tuple[int, ...]] = {}
    for entry in range(at + 2, at + 2 + 12 * count, 12):
        tag, kind, length = struct.unpack_from(f"{order}HHI", data, entry)
        if tag not in _TIFF_TAGS - fields.keys() or kind not in _TIFF_TYPES:
            continue
        if 2 * length > len(data):
            raise struct.error("more values than the file has room for")
        values = f"{order}{length}{_TIFF_TYPES[kind]}"
        place = entry + 8
        if struct.calcsize(values) > 4:
            (place,) = struct.unpack_from(f"{order}I", data, place)
        fields[tag] = struct.unpack_from(values, data, place)
    (following,) = struct.unpack_from(f"{order}I", data, at + 2 + 12 * count)
    return fields, following
