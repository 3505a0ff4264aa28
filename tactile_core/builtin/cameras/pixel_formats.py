"""Formats in which machine-vision cameras send their pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_core.quantities import Pixels


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
