"""Single images, read losslessly; damaged, oversized and unsupported files are rejected."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import MAX_PIXELS, read_bytes, read_start, write_atomically
from tactile_core.formats.headers import Header, header, is_torn, without_orientation

# Extensions of the image files of a folder.
IMAGE_SUFFIXES = frozenset(
    {".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff", ".webp"}
)

# Values of `OPENCV_LOG_LEVEL` that switch OpenCV's log off.
_SILENT = frozenset({"OFF", "SILENT", "0"})

# Held while stderr is redirected: it belongs to the whole process, and cameras read in threads.
_STDERR = Lock()


class UnfinishedImage(InputError):
    """The content is no image, or the rest of it is missing or damaged."""


@dataclass(frozen=True)
class ImageKind:
    """The properties that all images of one recording share.

    Attributes
    ----------
    width_px, height_px : int
    channels : int
        1 for grey, 3 for colour; an alpha channel does not count.
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
    def from_pixels(cls, pixels: NDArray[Any]) -> ImageKind:
        """Return the kind of decoded pixels."""
        channels = 1 if pixels.ndim == 2 else pixels.shape[2]
        return cls(pixels.shape[1], pixels.shape[0], channels, 8 * pixels.dtype.itemsize)


def image_kind(path: Path) -> ImageKind:
    """Return an image file's size, channels and bit depth.

    Only the header of a PNG or JPEG is read; other formats are decoded.

    Raises
    ------
    InputError
        The file is missing or not an image.
    """
    path = Path(path)
    found = header(read_start(path, 1 << 16))  # [bytes] metadata can precede the header
    if found is None or not found.channels:
        return ImageKind.from_pixels(read_image(path))
    _check(str(path), found)
    return ImageKind(found.width_px, found.height_px, found.channels, found.bits)


def read_image(path: Path) -> NDArray[Any]:
    """Read an image as stored; 16 bits stay 16 bits.

    Orientation tags are ignored in every format, and an alpha channel is dropped.

    Returns
    -------
    (H, W) or (H, W, 3) uint8 or uint16
        Grey, or colour in R, G, B order.

    Raises
    ------
    InputError
        The file is missing, not an image, truncated or damaged, too large, of an unsupported type,
        or contains several images.
    """
    path = Path(path)
    data = read_bytes(path)
    with _silence_decoders():
        return decode_image(data, str(path))


def decode_image(data: bytes, name: str) -> NDArray[Any]:
    """Decode the content of an image file, as :func:`read_image` does.

    Parameters
    ----------
    data : bytes
    name : str
        Where it comes from, in messages.

    Returns
    -------
    (H, W) or (H, W, 3) uint8 or uint16
        Grey, or colour in R, G, B order.

    Raises
    ------
    InputError
        It is not an image, truncated or damaged, too large, of an unsupported type, or contains
        several images.
    """
    # checked before decoding, which may exhaust memory, print to stderr or fill gaps with grey
    found = header(data)
    if found is None:
        raise UnfinishedImage(
            f"{name} is not a readable image, whatever its extension; save it as PNG, JPEG, BMP, "
            f"TIFF, WebP, PGM or PPM"
        )
    _check(name, found)
    pixels = None if is_torn(data) else _decode(data)
    if pixels is None:
        raise UnfinishedImage(f"{name} is truncated or damaged; copy or record it again")
    if pixels.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{name} contains {pixels.dtype} values; save it with 8 or 16 bits")
    if pixels.ndim == 3 and (pixels.shape[2] < 3 or found.channels == 1):
        return np.ascontiguousarray(pixels[..., 0])
    return pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., 2::-1])


def write_png(path: Path, pixels: NDArray[Any]) -> None:
    """Write a PNG atomically.

    Parameters
    ----------
    path : Path
        An existing file is replaced.
    pixels : (H, W) or (H, W, 3) uint8 or uint16
        Grey, or colour in R, G, B order.

    Raises
    ------
    InputError
        The array is no image.
    OSError
        The disk is full or not writable.
    """
    import cv2

    shape, dtype = np.shape(pixels), getattr(pixels, "dtype", None)
    whole = len(shape) == 2 or (len(shape) == 3 and shape[2] == 3)
    if not whole or 0 in shape or dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"{path}: an array of {dtype} with shape {shape} is no image; give (H, W) or (H, W, 3) "
            f"uint8 or uint16"
        )
    ordered = pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., ::-1])
    _, encoded = cv2.imencode(".png", ordered)
    write_atomically(path, encoded.data)


def _check(path: str, found: Header) -> None:
    """Reject an image that must not be decoded."""
    if found.frames > 1:
        raise InputError(
            f"{path} contains several images, but only one would be measured; save each image as a "
            f"separate file, or all of them as a video"
        )
    if min(found.width_px, found.height_px) < 1:
        raise InputError(f"{path} has no pixels; record or save it again")
    if found.width_px * found.height_px > MAX_PIXELS:
        raise InputError(
            f"{path} has {found.width_px} × {found.height_px} pixels, more than the limit of "
            f"{MAX_PIXELS / 1e6:.0f} megapixels; crop it or make it smaller"
        )


def _decode(data: bytes) -> NDArray[Any] | None:
    import cv2

    try:
        pixels: NDArray[Any] | None = cv2.imdecode(
            np.frombuffer(without_orientation(data), np.uint8), cv2.IMREAD_UNCHANGED
        )
    except cv2.error:
        return None
    return pixels


@contextmanager
def _silence_decoders() -> Iterator[None]:
    """Silence the decoding libraries too if OpenCV's own log is switched off."""
    if os.environ.get("OPENCV_LOG_LEVEL") not in _SILENT:
        yield
        return
    with _STDERR:
        try:
            stderr = os.dup(2)
        except OSError:  # it is closed
            yield
            return
        try:
            with Path(os.devnull).open("wb") as nowhere:
                os.dup2(nowhere.fileno(), 2)
            yield
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)


def write_normals(path: Path, normals: NDArray[np.float32]) -> None:
    """Write unit normals.

    Parameters
    ----------
    path : Path
        An existing file is replaced.
    normals : (H, W, 3) float32
        As in :attr:`tactile_core.quantities.Gradients.normals`; red, green and blue are x, y
        and z.

    Raises
    ------
    OSError
        The disk is full or not writable; no partial file remains.
    """
    codes = np.rint((np.clip(normals, -1, 1) + 1) * (65535 / 2)).astype(np.uint16)  # 16 bits
    write_png(path, codes)
