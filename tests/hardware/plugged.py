"""What the emulated devices are called and where they are plugged in; known to rig and guest."""

from __future__ import annotations

import numpy as np

FIRST, LIT, BOX = "C310A001", "C310A002", "L0001"
"""Serial numbers of a webcam that looks at a gel, of one that sees six lights, and of these."""

WEBCAMS = (FIRST, LIT)

MINI, DIGITS = "2BNN4ZE7", ("D20123", "D20124")
"""Serial numbers of a GelSight Mini and of two DIGITs."""

SENSORS = (MINI, *DIGITS)

PLUGS = {serial: f"1-{port}" for port, serial in enumerate((*WEBCAMS, BOX, *SENSORS), 1)}
"""Bus ids on the USB/IP server, in the order in which it numbers its devices."""

WIDTH, HEIGHT, FPS = 640, 480, 30
"""Format of the first webcam."""

LIT_SCALE = 8
"""Pixels of the second webcam for each of the virtual bench's."""

CAMERA, PROCESSING = 1, 3
"""Units of a webcam (UVC 1.0, section 3.7): input terminal and processing unit."""

ZOOM = 0x0B
"""Selector of the zoom, which sets a DIGIT's lights (UVC 1.0, section A.9.4)."""

_COMMENT = b"\xff\xfe\x00\x0a"
"""JPEG marker of a comment, and its length with that of the length."""


def numbered(jpeg: bytes, number: int) -> bytes:
    """Write a number of up to eight digits into a JPEG, as its first comment."""
    return jpeg[:2] + _COMMENT + b"%08d" % number + jpeg[2:]


def number_of(jpeg: bytes) -> int:
    """Return the number that :func:`numbered` wrote."""
    assert jpeg[2:6] == _COMMENT
    return int(jpeg[6:14])


_SIDE_PX, _CYCLE, _DARKEST, _STEP = 16, 64, 40, 3
"""Of the square in the corner of an uncompressed image whose luma is its number, modulo 64."""


def shaded(yuyv: bytes, width: int, number: int) -> bytes:
    """Write a number modulo 64 into an uncompressed image, as the grey of its upper left corner."""
    rows = np.frombuffer(yuyv, np.uint8).reshape(-1, 2 * width).copy()
    rows[:_SIDE_PX, : 2 * _SIDE_PX : 2] = _DARKEST + _STEP * (number % _CYCLE)
    rows[:_SIDE_PX, 1 : 2 * _SIDE_PX : 2] = 128
    return rows.tobytes()


def step_between(corner: np.ndarray, next_corner: np.ndarray) -> int:
    """Return by how much the number of an image is larger than that of another, modulo 64.

    The corners are of the images as they are read, grey from 0 to 255 where luma goes from 16 to
    235.
    """
    inside = slice(2, _SIDE_PX - 2)
    one, other = (float(part[inside, inside].mean()) for part in (corner, next_corner))
    return round((other - one) * 219 / 255 / _STEP) % _CYCLE


CORNER_PX = _SIDE_PX
