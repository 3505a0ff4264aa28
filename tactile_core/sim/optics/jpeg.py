"""Loss of JPEG compression in the camera."""

from __future__ import annotations

from functools import cache
from types import ModuleType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.interfaces.constant_light import COLOUR

_START_OF_SCAN, _QUANTISATION = 0xDA, 0xDB
"""Codes of two parts of a JPEG file (ITU-T T.81, table B.1)."""
_SIDE = 8
"""Side of a block, px; chroma has blocks of twice that."""


def compressed(
    pixels: NDArray[np.uint8], quality: int, compiled: ModuleType | None = None
) -> NDArray[Any]:
    """Compress and decompress an image.

    Parameters
    ----------
    pixels : (H, W, 1) or (H, W, 3) uint8
    quality : int
    compiled : module, optional
        :mod:`tactile_core.sim.kernels.compiled`: faster for whole blocks of colour, and equal.

    Returns
    -------
    uint8 of the same shape
    """
    height, width, colours = pixels.shape
    if colours != COLOUR:
        return _through_file(pixels, quality, cv2.IMREAD_GRAYSCALE).reshape(pixels.shape)
    if compiled is None or height % (2 * _SIDE) or width % (2 * _SIDE):
        swapped = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
        sent = _through_file(swapped, quality, cv2.IMREAD_COLOR)
        return np.asarray(cv2.cvtColor(sent, cv2.COLOR_BGR2RGB))
    sent = np.empty_like(pixels)
    compiled.transmit(
        np.ascontiguousarray(pixels).reshape(height, -1),
        steps_of(quality),
        sent.reshape(height, -1),
    )
    return sent


@cache
def steps_of(quality: int) -> NDArray[np.int32]:
    """(2, 64) quantisation of luma and chroma of a colour image: eight rows of each block."""
    _, data = cv2.imencode(
        ".jpg", np.zeros((_SIDE, _SIDE, COLOUR), np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality]
    )
    file, place, tables = data.tobytes(), 2, []
    while file[place + 1] != _START_OF_SCAN:
        stop = place + 2 + int.from_bytes(file[place + 2 : place + 4], "big")
        if file[place + 1] == _QUANTISATION:
            part = file[place + 4 : stop]
            # a number, and 64 steps
            tables += [list(part[k + 1 : k + 65]) for k in range(0, len(part), 65)]
        place = stop
    steps = np.zeros((2, _SIDE * _SIDE), np.int32)
    steps[:, _zigzag()] = tables
    return steps


def _through_file(pixels: NDArray[Any], quality: int, flag: int) -> NDArray[Any]:
    _, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(data, flag))


def _zigzag() -> list[int]:
    """Places of the coefficients in a block, in the order of a file."""

    def rank(place: int) -> tuple[int, int]:
        row, column = divmod(place, _SIDE)
        diagonal = row + column
        return diagonal, row if diagonal % 2 else column

    return sorted(range(_SIDE * _SIDE), key=rank)
