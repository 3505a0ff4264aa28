"""What the emulated devices are called and where they are plugged in; known to rig and guest."""

from __future__ import annotations

FIRST, LIT, BOX = "C310A001", "C310A002", "L0001"
"""Serial numbers of a webcam that looks at a gel, of one that sees six lights, and of these."""

WEBCAMS = (FIRST, LIT)

PLUGS = {FIRST: "1-1", LIT: "1-2", BOX: "1-3"}
"""Bus ids on the USB/IP server, in the order in which it numbers its devices."""

WIDTH, HEIGHT, FPS = 640, 480, 30
"""Format of the first webcam."""

LIT_SCALE = 8
"""Pixels of the second webcam for each of the virtual bench's."""

CAMERA, PROCESSING = 1, 3
"""Units of a webcam (UVC 1.0, section 3.7): input terminal and processing unit."""

_COMMENT = b"\xff\xfe\x00\x0a"
"""JPEG marker of a comment, and its length with that of the length."""


def numbered(jpeg: bytes, number: int) -> bytes:
    """Write a number of up to eight digits into a JPEG, as its first comment."""
    return jpeg[:2] + _COMMENT + b"%08d" % number + jpeg[2:]


def number_of(jpeg: bytes) -> int:
    """Return the number that :func:`numbered` wrote."""
    assert jpeg[2:6] == _COMMENT
    return int(jpeg[6:14])
