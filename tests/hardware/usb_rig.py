"""Emulated webcams on a USB/IP server, and a control port through which a test disturbs them.

Run on this computer with the two ports as arguments; a guest's kernel attaches the devices.
"""

from __future__ import annotations

import json
import socket
import struct
import sys
import threading
import time

import cv2
import numpy as np
from usbip.classes.device.uvc import (
    CS_INTERFACE,
    STREAM_EOF,
    STREAM_FID,
    UVC,
    VideoControl,
    VideoStreaming,
    _interface,
)
from usbip.core import SPEED_HIGH, Stall
from usbip.device import USBDevice
from usbip.transport import USBIP

WIDTH, HEIGHT, FPS = 320, 240, 30
SERIALS = ("C310A001", "C310A002")
IMAGES = 64
"""Different images of one camera; each shows its number in bits."""

CAMERA, PROCESSING = 1, 3
"""Units of the camera (UVC 1.0, section 3.7): input terminal and processing unit."""

_SET, _GET = 0x01, 0x81
_GET_LENGTH, _GET_INFO = 0x85, 0x86
_FIELDS = {0x81: "value", 0x82: "lowest", 0x83: "highest", 0x84: "step", 0x87: "value"}
"""Requests GET_CUR, GET_MIN, GET_MAX, GET_RES and GET_DEF (UVC 1.0, table A-8)."""


class Control:
    """One control of a camera, which clamps what it is set to."""

    def __init__(self, size: int, value: int, lowest: int, highest: int, step: int = 1) -> None:
        self.size, self.value = size, value
        self.lowest, self.highest, self.step = lowest, highest, step


def picture(number: int, tint: int) -> bytes:
    """Return a JPEG that shows a number as eight black or white fields."""
    pixels = np.full((HEIGHT, WIDTH, 3), 100, np.uint8)
    pixels[..., tint] = 160
    for bit in range(8):
        width = WIDTH // 8
        pixels[: HEIGHT // 4, bit * width : (bit + 1) * width] = 255 if number >> bit & 1 else 0
    return bytes(cv2.imencode(".jpg", pixels)[1])


class Controls(VideoControl):
    """Exposure, gain and white balance, automatic at first."""

    def __init__(self) -> None:
        super().__init__()
        self.controls = {
            (CAMERA, 0x02): Control(1, 8, 0, 15, 9),  # exposure mode: aperture priority
            (CAMERA, 0x04): Control(4, 156, 1, 5000),  # exposure, 100 µs
            (PROCESSING, 0x04): Control(2, 64, 0, 255),  # gain
            (PROCESSING, 0x0A): Control(2, 4000, 2800, 6500, 10),  # white balance, K
            (PROCESSING, 0x0B): Control(1, 1, 0, 1),  # automatic white balance
        }

    def descriptor_block(self) -> bytes:
        own, streaming = self.interface_number, self.interface_number + 1
        exposure = (1 << 1 | 1 << 3).to_bytes(3, "little")
        processing = 1 << 9 | 1 << 6 | 1 << 12
        units = struct.pack("<BBBBHBBHHHB", 18, CS_INTERFACE, 2, 1, 0x0201, 0, 0, 0, 0, 0, 3)
        units += exposure
        units += struct.pack("<BBBBBHBHB", 11, CS_INTERFACE, 5, PROCESSING, 1, 0, 2, processing, 0)
        units += struct.pack("<BBBBHBBB", 9, CS_INTERFACE, 3, 2, 0x0101, 0, PROCESSING, 0)
        head = struct.pack(
            "<BBBHHIBB", 13, CS_INTERFACE, 1, 0x0100, 13 + len(units), 48_000_000, 1, streaming
        )
        return bytes(_interface(own, 0, 0, 1)) + head + units

    def on_control(self, setup: object, data: bytes = b"") -> bytes:
        control = self.controls.get((setup.wIndex >> 8, setup.wValue >> 8))
        request = setup.bRequest
        if control is None:
            raise Stall
        if request == _SET:
            asked = int.from_bytes(data[: control.size], "little")
            control.value = min(max(asked, control.lowest), control.highest)
            return b""
        if request == _GET_INFO:
            return b"\x03"
        if request == _GET_LENGTH:
            return struct.pack("<H", control.size)
        if request not in _FIELDS:
            raise Stall
        return int(getattr(control, _FIELDS[request])).to_bytes(control.size, "little")


class Streaming(VideoStreaming):
    """One image per frame period, and empty packets in between."""

    def __init__(self, tint: int) -> None:
        super().__init__(WIDTH, HEIGHT, FPS, ("mjpeg",))
        self.stalled = False
        self.torn = 0
        self.sent = 0
        self._images = [picture(number, tint) for number in range(IMAGES)]
        self._due = 0.0

    def on_iso(self, ep: object, lengths: list[int]) -> list[bytes]:
        if not self.streaming:
            return []
        packets = []
        for length in lengths:
            if not self._frame and not self._begin():
                packets.append(b"")
                continue
            data = self._frame[self._pos : self._pos + length - 2]
            self._pos += len(data)
            last = self._pos >= len(self._frame)
            packets.append(bytes((2, self._fid | (STREAM_EOF if last else 0))) + data)
            if last:
                self._frame = b""
                self._fid ^= STREAM_FID
        return packets

    def _begin(self) -> bool:
        now = time.monotonic()
        if self.stalled or now < self._due:
            return False
        self._due = max(self._due + 1 / FPS, now - 1 / FPS)
        self._frame, self._pos = self._images[self.sent % IMAGES], 0
        if self.torn:
            self.torn -= 1
            self._frame = self._frame[: len(self._frame) // 2]
        self.sent += 1
        return True


class Webcam:
    """A webcam like Logitech's C310."""

    def __init__(self, serial: str, tint: int) -> None:
        self.device = USBDevice(
            0x046D, 0x081B, manufacturer="Logitech", product="HD Webcam C310", serial=serial
        )
        self.device.set_speed(SPEED_HIGH)
        function = UVC(WIDTH, HEIGHT, FPS, formats=("mjpeg",))
        self.controls, self.streaming = Controls(), Streaming(tint)
        function.vc, function.vs = self.controls, self.streaming
        function._interfaces = [self.controls, self.streaming]
        for interface in function._interfaces:
            interface.func = function
        self.device.add(function)
        self.device.set_iso_pacing(True)

    def asked(self, what: str, *values: int) -> object:
        """Carry out one request of a test."""
        if what == "stall":
            self.streaming.stalled = bool(values[0])
        elif what == "tear":
            self.streaming.torn = values[0]
        elif what == "sent":
            return self.streaming.sent
        elif what == "control":
            return self.controls.controls[values[0], values[1]].value
        return None


def serve(usb_port: int, control_port: int) -> None:
    """Serve the devices and answer requests, one JSON list a line, until the input ends."""
    cameras = {serial: Webcam(serial, 2 * number) for number, serial in enumerate(SERIALS)}
    transport = USBIP("127.0.0.1", usb_port)
    for camera in cameras.values():
        camera.device.plug(via=transport)
    server = socket.create_server(("127.0.0.1", control_port))

    def answer(connection: socket.socket) -> None:
        with connection, connection.makefile("rw") as lines:
            for line in lines:
                serial, what, *values = json.loads(line)
                print(json.dumps(cameras[serial].asked(what, *values)), file=lines, flush=True)

    def accept() -> None:
        while True:
            connection, _ = server.accept()
            threading.Thread(target=answer, args=(connection,), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    print("serving", flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    serve(int(sys.argv[1]), int(sys.argv[2]))
