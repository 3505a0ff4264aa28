"""Images of GenICam cameras, and their pixel formats."""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass
from threading import Event
from typing import Any

import numpy as np

from tactile_core.errors import CameraLost, CameraTimeout, LibraryMissing
from tactile_core.interfaces.streaming.encoded_image import TornImage, wall_time_at
from tactile_core.interfaces.streaming.streaming_camera import ImageSource
from tactile_core.quantities import Image, Pixels


@dataclass(frozen=True)
class PixelFormat:
    """How the pixels of an image are stored; none is packed.

    Attributes
    ----------
    bits : int
        Of one value. Values of more than eight bits are the lowest bits of two bytes, so that
        10 bits end at 1023: 'image.bit_depth' in the profile.
    channels : int
    is_reversed : bool
        Whether blue comes first.
    mosaic : str
        Colours of the first two rows of a Bayer mosaic, as in "RGGB"; "" for none.
    """

    bits: int
    channels: int = 1
    is_reversed: bool = False
    mosaic: str = ""

    def size(self, rows: int, columns: int) -> int:
        """Return the bytes of an image."""
        return rows * columns * self.channels * self._dtype.itemsize

    def pixels(self, data: bytes, rows: int, columns: int) -> Pixels:
        """Return the pixels.

        Parameters
        ----------
        data : bytes
            At least :meth:`size`; what follows is left out.
        rows, columns : int

        Returns
        -------
        (H, W) or (H, W, 3) uint8 or uint16
            RGB. The missing colours of a mosaic are interpolated linearly.
        """
        shape = (rows, columns) if self.channels == 1 else (rows, columns, self.channels)
        stored = np.frombuffer(data, self._dtype, count=int(np.prod(shape))).reshape(shape)
        if self.mosaic:
            import cv2

            code: int = getattr(cv2, f"COLOR_Bayer{self.mosaic}2RGB")
            return np.asarray(cv2.cvtColor(stored, code))
        return np.ascontiguousarray(stored[..., ::-1]) if self.is_reversed else stored

    @property
    def _dtype(self) -> np.dtype[np.unsignedinteger[Any]]:
        return np.dtype(np.uint8 if self.bits <= 8 else "<u2")


_MOSAICS = {"RG": "RGGB", "GR": "GRBG", "GB": "GBRG", "BG": "BGGR"}

# Formats that can be read, by their names in the standard. References ---------- .. [1] EMVA,
# "GenICam Pixel Format Naming Convention (PFNC)", version 2.4, 2021.
PIXEL_FORMATS = {
    **{f"Mono{bits}": PixelFormat(bits) for bits in (8, 10, 12, 14, 16)},
    "RGB8": PixelFormat(8, 3),
    "BGR8": PixelFormat(8, 3, True),
    **{
        f"Bayer{first}{bits}": PixelFormat(bits, mosaic=mosaic)
        for first, mosaic in _MOSAICS.items()
        for bits in (8, 10, 12, 16)
    },
}

# Where Debian's packages install Python modules, which a virtual environment does not search.
_DEBIAN_PACKAGES = "/usr/lib/python3/dist-packages"


class GenicamSource(ImageSource):
    """A camera that has been configured and acquires images.

    Parameters
    ----------
    camera : Aravis.Camera
        Belongs to the source from now on.
    name : str
        In messages.
    pixel_format : str
        A key of :data:`~tactile_genicam.image_source.PIXEL_FORMATS`.

    Attributes
    ----------
    exposure_time_s, gain : float
        What the images carry.
    """

    def __init__(self, camera: Any, name: str, pixel_format: str) -> None:
        self.exposure_time_s: float | None = None
        self.gain: float | None = None
        self._camera, self._name = camera, name
        self._form = PIXEL_FORMATS[pixel_format]
        self._last_s = float("-inf")
        # the handler must not hold the camera, or that would never be released
        lost = self._lost = Event()
        self._device = camera.get_device()
        self._handler = self._device.connect("control-lost", lambda *_: lost.set())
        aravis = library()
        self._stream = camera.create_stream(None, None)
        size = camera.get_payload()
        for _ in range(10):  # [images] a third of a second at 30 Hz, while the computer is busy
            self._stream.push_buffer(aravis.Buffer.new_allocate(size))
        self._success = aravis.BufferStatus.SUCCESS
        camera.start_acquisition()

    def grab(self) -> Image | None:
        """Return the next image."""
        # [µs] bounds the time that closing takes while a camera stalls
        buffer = self._stream.timeout_pop_buffer(200_000)
        if buffer is None:
            if self._lost.is_set():
                raise CameraLost(
                    f"{self._name} does not answer any more; check its cable and power, and open "
                    f"it again"
                )
            raise CameraTimeout(f"{self._name} sends nothing")
        try:
            if buffer.get_status() != self._success:
                raise TornImage(f"{self._name} sent an incomplete image")
            pixels = self._pixels(
                buffer.get_data(), buffer.get_image_height(), buffer.get_image_width()
            )
            arrived_s = self._arrived_s(buffer.get_system_timestamp())
        finally:
            self._stream.push_buffer(buffer)
        timestamp_s = arrived_s - (self.exposure_time_s or 0.0) / 2
        return Image(
            pixels,
            timestamp_s=timestamp_s,
            wall_time_s=wall_time_at(timestamp_s),
            exposure_time_s=self.exposure_time_s,
            gain=self.gain,
        )

    def trigger(self) -> None:
        """Begin an exposure.

        Raises
        ------
        CameraLost
            The camera does not answer.
        """
        try:
            self._camera.software_trigger()
        except library_error() as error:
            raise CameraLost(f"{self._name} does not answer: {error.message}") from error

    def close(self) -> None:
        """Stop the camera and release it."""
        try:
            if not self._lost.is_set():  # the library would ask a lost camera for seconds
                self._camera.stop_acquisition()
        except library_error():
            pass  # it is lost just now
        finally:
            self._device.disconnect(self._handler)
            # the library releases what nothing refers to
            del self._stream, self._device, self._camera

    def _pixels(self, data: bytes, rows: int, columns: int) -> Pixels:
        size = self._form.size(rows, columns)
        if len(data) < size:
            raise TornImage(f"{self._name} sent {len(data)} bytes instead of {size}")
        # get_data copies, so the buffer may be reused
        return self._form.pixels(data, rows, columns)

    def _arrived_s(self, system_ns: int) -> float:
        """Return when the first bytes came, on the monotonic clock."""
        now_s = time.monotonic()
        arrived_s = now_s - max(0.0, time.time() - system_ns / 1e9)
        # the wall clock may be set back; exposures still follow one another
        self._last_s = max(arrived_s, self._last_s + 1e-6)
        return self._last_s


def library() -> Any:
    """Return the Aravis module.

    Raises
    ------
    DeviceError
        It is not installed.
    """
    try:
        with warnings.catch_warnings():
            # PyGObject's importer lacks a method that Python has asked for since 3.6
            warnings.simplefilter("ignore", ImportWarning)
            return _import_aravis()
    except (ImportError, ValueError) as error:
        raise LibraryMissing(
            f"genicam.camera needs the library Aravis ({error}); on Debian and Ubuntu 'sudo apt "
            f"install gir1.2-aravis-0.8 python3-gi', elsewhere 'pip install PyGObject' and "
            f"https://aravisproject.github.io"
        ) from error


def _import_aravis() -> Any:
    try:
        import gi
    except ImportError:
        sys.path.append(_DEBIAN_PACKAGES)
        try:
            import gi
        finally:
            sys.path.remove(_DEBIAN_PACKAGES)
    gi.require_version("Aravis", "0.8")
    from gi.repository import Aravis

    return Aravis


def library_error() -> Any:
    """Return the class of the errors that :func:`library` raises."""
    from gi.repository import GLib

    return GLib.Error
