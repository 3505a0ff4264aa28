"""Single images: read without loss, refused in one sentence when they are not what they claim."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes, write_atomically

IMAGE_SUFFIXES = frozenset(
    {".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff", ".webp"}
)

_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8\xff"
_PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 1, 6: 3}
_SOF = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_SOS = 0xDA
_HEADER_BYTES = 1 << 16


@dataclass(frozen=True)
class ImageKind:
    """What all images of one recording must share.

    Attributes
    ----------
    width_px, height_px : int
    channels : int
        1 for grey, 3 for colour; transparency does not count.
    bits : int
        8 or 16.
    """

    width_px: int
    height_px: int
    channels: int
    bits: int

    def __str__(self) -> str:
        colour = "grey" if self.channels == 1 else "RGB"
        return f"{self.width_px} × {self.height_px} {colour}, {self.bits} bits"

    @classmethod
    def of(cls, pixels: NDArray[Any]) -> ImageKind:
        """Tell the kind of decoded pixels."""
        channels = 1 if pixels.ndim == 2 else pixels.shape[2]
        return cls(pixels.shape[1], pixels.shape[0], channels, 8 * pixels.dtype.itemsize)


def image_kind(path: Path) -> ImageKind:
    """Tell size, channels and depth, from a PNG's or JPEG's header alone.

    Raises
    ------
    InputError
        The file is missing or no image.
    """
    try:
        with Path(path).open("rb") as file:
            head = file.read(_HEADER_BYTES)
    except OSError:
        head = read_bytes(path)
    return _kind(head) or ImageKind.of(read_image(path))


def read_image(path: Path) -> NDArray[Any]:
    """Read an image as it was stored; 16 bits stay 16 bits.

    An orientation noted by a camera is ignored, and transparency is dropped.

    Returns
    -------
    (H, W) or (H, W, 3) uint8 or uint16
        Grey, or colour in R, G, B order.

    Raises
    ------
    InputError
        The file is missing, no image, truncated or damaged, or of an unsupported type.
    """
    path = Path(path)
    data = read_bytes(path)
    # checked before decoding: the decoders print to stderr, or return an image with a grey rest
    if not _whole(data):
        raise InputError(f"{path} is truncated or damaged; copy or record it again")
    pixels = _decode(data)
    if pixels is None:
        raise InputError(f"{path} is no image that can be read, whatever its name says")
    if pixels.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{path} holds {pixels.dtype} values; save it with 8 or 16 bits")
    kind = _kind(data)
    if pixels.ndim == 3 and (pixels.shape[2] < 3 or (kind is not None and kind.channels == 1)):
        return np.ascontiguousarray(pixels[..., 0])
    return pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., 2::-1])


def write_png(path: Path, pixels: NDArray[Any]) -> None:
    """Write a PNG, whole or not at all.

    Parameters
    ----------
    path : Path
        The file; it is replaced when it exists.
    pixels : (H, W) or (H, W, 3) uint8 or uint16
        Grey, or colour in R, G, B order.

    Raises
    ------
    OSError
        The disk is full or refuses.
    """
    import cv2

    ordered = pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., ::-1])
    _, encoded = cv2.imencode(".png", ordered)
    write_atomically(path, encoded.data)


def _decode(data: bytes) -> NDArray[Any] | None:
    import cv2

    if not data:
        return None
    try:
        pixels: NDArray[Any] | None = cv2.imdecode(
            np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED
        )
    except cv2.error:
        return None
    return pixels


def _kind(data: bytes) -> ImageKind | None:
    """Kind by the header of a PNG or JPEG; None for other formats and headers beyond the data."""
    if data.startswith(_PNG) and len(data) > 25:
        width, height = (int.from_bytes(data[i : i + 4], "big") for i in (16, 20))
        return ImageKind(width, height, _PNG_CHANNELS.get(data[25], 3), max(8, data[24]))
    if data.startswith(_JPEG):
        for marker, at in _jpeg_segments(data):
            if marker in _SOF and at + 10 <= len(data):
                height, width = (int.from_bytes(data[at + i : at + i + 2], "big") for i in (5, 7))
                return ImageKind(width, height, 1 if data[at + 9] == 1 else 3, 8)
    return None


def _whole(data: bytes) -> bool:
    if data.startswith(_PNG):
        return _whole_png(memoryview(data))
    if data.startswith(_JPEG):
        scan = next((at for marker, at in _jpeg_segments(data) if marker == _SOS), None)
        # within the coded data a true end marker cannot occur by chance: 0xFF is stuffed there
        return scan is not None and data.find(b"\xff\xd9", scan) >= 0
    return True


def _whole_png(data: memoryview) -> bool:
    at = len(_PNG)
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        end = at + 8 + length
        if end + 4 > len(data) or zlib.crc32(data[at + 4 : end]) != int.from_bytes(
            data[end : end + 4], "big"
        ):
            return False
        if bytes(data[at + 4 : at + 8]) == b"IEND":
            return True
        at = end + 4
    return False


def _jpeg_segments(data: bytes) -> list[tuple[int, int]]:
    """(marker, offset of the marker) of each segment up to the coded data."""
    segments, at = [], 2
    while at + 4 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF:  # padding
            at += 1
            continue
        segments.append((marker, at))
        if marker == _SOS:
            break
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return segments
