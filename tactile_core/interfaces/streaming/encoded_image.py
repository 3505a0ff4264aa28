"""Compressed images of a camera."""

from __future__ import annotations

from tactile_core.errors import InputError
from tactile_core.formats.headers import header, is_complete
from tactile_core.formats.images import decode_image
from tactile_core.interfaces.streaming.image_reader import TornImage, wall_time_at
from tactile_core.quantities import Image


def decoded(
    data: bytes,
    timestamp_s: float,
    name: str,
    *,
    exposure_time_s: float | None = None,
    gain: float | None = None,
) -> Image:
    """Return the image that a camera sent as a JPEG, together with what it sent.

    Parameters
    ----------
    data : bytes
    timestamp_s : float
        Host monotonic time at mid-exposure.
    name : str
        Of the camera, in messages.
    exposure_time_s, gain : float, optional
        Settings of the camera.

    Raises
    ------
    TornImage
        It is incomplete or cannot be decoded.
    """
    # decoders fill what is missing with grey, so a torn image must be found before
    if header(data) is None or not is_complete(data):
        raise TornImage(f"{name} sent an incomplete image")
    try:
        pixels = decode_image(data, name)
    except InputError as error:
        raise TornImage(str(error)) from error
    return Image(
        pixels,
        timestamp_s=timestamp_s,
        wall_time_s=wall_time_at(timestamp_s),
        exposure_time_s=exposure_time_s,
        gain=gain,
        encoded=data,
    )
