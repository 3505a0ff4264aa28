"""Compressed images of a camera, which are decoded when they are read."""

from __future__ import annotations

import time
from dataclasses import dataclass

from tactile_core.errors import InputError
from tactile_core.formats.headers import header, is_torn
from tactile_core.formats.images import decode_image
from tactile_core.quantities import Image


class TornImage(Exception):
    """An image arrived incomplete or cannot be decoded; the next one may be whole."""


@dataclass(frozen=True, eq=False)
class EncodedImage:
    """An image as a camera compressed it.

    Attributes
    ----------
    encoded : bytes
        For example a JPEG.
    camera : str
        In messages.
    timestamp_s, wall_time_s, sequence, exposure_time_s, gain
        See :class:`~tactile_core.quantities.Image`.
    """

    encoded: bytes
    camera: str
    timestamp_s: float
    wall_time_s: float
    sequence: int = 0
    exposure_time_s: float | None = None
    gain: float | None = None

    @property
    def nbytes(self) -> int:
        """Memory that it takes, bytes."""
        return len(self.encoded)

    def decode_pixels(self) -> Image:
        """Return its pixels, together with the bytes.

        Raises
        ------
        TornImage
            It cannot be decoded.
        """
        try:
            pixels = decode_image(self.encoded, self.camera)
        except InputError as error:
            raise TornImage(str(error)) from error
        return Image(
            pixels,
            timestamp_s=self.timestamp_s,
            wall_time_s=self.wall_time_s,
            sequence=self.sequence,
            exposure_time_s=self.exposure_time_s,
            gain=self.gain,
            encoded=self.encoded,
        )


def encoded_image(
    data: bytes,
    timestamp_s: float,
    camera: str,
    *,
    exposure_time_s: float | None = None,
    gain: float | None = None,
) -> EncodedImage:
    """Return an image that a camera sent compressed, without decoding it.

    Parameters
    ----------
    data : bytes
    timestamp_s : float
        Host monotonic time at mid-exposure.
    camera : str
        In messages.
    exposure_time_s, gain : float, optional
        Settings of the camera.

    Raises
    ------
    TornImage
        It is incomplete, or no image at all.
    """
    # decoders fill what is missing with grey, so a torn image must be found before
    if header(data) is None or is_torn(data):
        raise TornImage(f"{camera} sent an incomplete image")
    return EncodedImage(
        data,
        camera,
        timestamp_s,
        wall_time_at(timestamp_s),
        exposure_time_s=exposure_time_s,
        gain=gain,
    )


def wall_time_at(timestamp_s: float) -> float:
    """Return the wall-clock time at a time of the host's monotonic clock."""
    return time.time() - (time.monotonic() - timestamp_s)
