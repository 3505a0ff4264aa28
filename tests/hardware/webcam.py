"""An emulated webcam, which begins an image only after it has sent the one before whole."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from itertools import count
from threading import Condition, Thread
from typing import Any

from hardware.plugged import CAMERA, FPS, PROCESSING, numbered
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

_SET = 0x01
_GET_LENGTH, _GET_INFO = 0x85, 0x86
_FIELDS = {0x81: "value", 0x82: "lowest", 0x83: "highest", 0x84: "step", 0x87: "value"}
"""Requests GET_CUR, GET_MIN, GET_MAX, GET_RES and GET_DEF (UVC 1.0, table A-8)."""

_SET_INTERFACE, _NO_SPACE = b"\x01\x0b", -28
"""First bytes of that request (USB 2.0, section 9.4.10), and Linux's status of a full bus."""

_MICROFRAME_S = 125e-6
_TRANSACTION_BYTES, _TRANSACTIONS = 1024, 3
"""Of an isochronous packet at high speed, at most (USB 2.0, section 5.6.3)."""


class Control:
    """One control of a camera, which clamps what it is set to."""

    def __init__(self, size: int, value: int, lowest: int, highest: int, step: int = 1) -> None:
        self.size, self.value = size, value
        self.lowest, self.highest, self.step = lowest, highest, step


class Controls(VideoControl):  # type: ignore[misc]
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

    def on_control(self, setup: Any, data: bytes = b"") -> bytes:
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


class Streaming(VideoStreaming):  # type: ignore[misc]
    """One image per frame period, and empty packets in between.

    Attributes
    ----------
    sent : int
        Images that were transmitted to their last byte; each carries its number.
    skipped : int
        Images that were never taken, because the host asked for the one before too slowly.
    stalled : bool
    torn : int
        Images to come that end in their middle.
    packet_s : float
        Time of a packet.
    """

    def __init__(
        self, width: int, height: int, picture: Callable[[float], bytes], interval: int
    ) -> None:
        super().__init__(width, height, FPS, ("mjpeg",))
        self.packet_s = _MICROFRAME_S * 2 ** (interval - 1)
        self.sent = self.skipped = self.torn = 0
        self.stalled = False
        self._picture, self._interval = picture, interval
        self._begun = 0
        self._due_s = 0.0

    def adjust_for_speed(self, speed: int) -> None:
        self.video_in.mps = _TRANSACTIONS * _TRANSACTION_BYTES

    def descriptor_block(self) -> bytes:
        block = bytes(super().descriptor_block())
        size = _TRANSACTION_BYTES | (_TRANSACTIONS - 1) << 11
        return block[:-3] + struct.pack("<HB", size, self._interval)  # of its one endpoint

    def set_alt(self, alt: int) -> None:
        super().set_alt(alt)
        self._due_s = time.monotonic()

    def fill(self, urb: Any) -> None:
        """Put the packets into a request that are due in its time."""
        chunks = []
        for packet in urb.iso_packets:
            chunk = self._packet(packet[1]) if self._frame or self._begin() else b""
            packet[2], packet[3] = len(chunk), 0
            chunks.append(chunk)
        urb.buffer = b"".join(chunks)
        urb.actual, urb.status = len(urb.buffer), 0

    def _packet(self, length: int) -> bytes:
        data = self._frame[self._pos : self._pos + length - 2]
        self._pos += len(data)
        last = self._pos >= len(self._frame)
        head = bytes((2, self._fid | (STREAM_EOF if last else 0)))
        if last:
            self._frame = b""
            self._fid ^= STREAM_FID
            self.sent += 1
        return head + data

    def _begin(self) -> bool:
        now_s = time.monotonic()
        if self.stalled or not self.streaming or now_s < self._due_s:
            return False
        periods = int((now_s - self._due_s) * FPS)
        self.skipped += periods
        self._due_s += (periods + 1) / FPS
        self._frame, self._pos = numbered(self._picture(now_s), self._begun), 0
        if self.torn:
            self.torn -= 1
            self._frame = self._frame[: len(self._frame) // 2]
        self._begun += 1
        return True


class Webcam(USBDevice):  # type: ignore[misc]
    """A webcam like Logitech's C310.

    Parameters
    ----------
    serial : str
    width, height : int
    picture : callable
        Returns the JPEG of which the transmission begins at a time.
    interval : int
        ``bInterval`` of its endpoint. The kernel asks for 32 packets at a time: a larger interval
        means fewer requests, and coarser timestamps.

    Attributes
    ----------
    crowded : bool
        Whether the bus has no bandwidth left for its images.
    """

    def __init__(
        self,
        serial: str,
        width: int,
        height: int,
        picture: Callable[[float], bytes],
        interval: int = 1,
    ) -> None:
        super().__init__(
            0x046D, 0x081B, manufacturer="Logitech", product="HD Webcam C310", serial=serial
        )
        self.set_speed(SPEED_HIGH)
        function = UVC(width, height, FPS, formats=("mjpeg",))
        self.controls = Controls()
        self.streaming = Streaming(width, height, picture, interval)
        function.vc, function.vs = self.controls, self.streaming
        function._interfaces = [self.controls, self.streaming]
        for interface in function._interfaces:
            interface.func = function
        self.add(function)
        self.crowded = False
        self._waiting: list[tuple[float, Any, Any]] = []
        self._changed = Condition()
        self._until_s = 0.0
        Thread(target=self._transmit, daemon=True).start()

    def handle_urb(self, urb: Any, respond: Any = None) -> Any:
        """Queue a request for images until its time, and answer others at once."""
        if urb.iso_packets is None:
            answered = super().handle_urb(urb, respond)
            if self.crowded and urb.ep == 0 and urb.setup[:2] == _SET_INTERFACE and urb.setup[2]:
                urb.status = _NO_SPACE  # what the kernel's own hosts say before they ask
            return answered
        with self._changed:
            begin_s = max(self._until_s, time.monotonic())
            self._until_s = begin_s + self.streaming.packet_s * len(urb.iso_packets)
            self._waiting.append((self._until_s, urb, respond))
            self._changed.notify()
        return None

    def cancel_urb(self, seqnum: int) -> None:
        """Forget a request; it is not answered afterwards, which would confuse the kernel."""
        with self._changed:
            self._waiting = [one for one in self._waiting if one[1].seqnum != seqnum]
        super().cancel_urb(seqnum)

    def asked(self, what: str, *values: int) -> object:
        """Carry out one request of a test."""
        if what == "stall":
            self.streaming.stalled = bool(values[0])
        elif what == "tear":
            self.streaming.torn = values[0]
        elif what == "crowd":
            self.crowded = bool(values[0])
        elif what == "sent":
            return [self.streaming.sent, self.streaming.skipped]
        elif what == "control":
            return self.controls.controls[values[0], values[1]].value
        return None

    def _transmit(self) -> None:
        for _ in count():
            with self._changed:
                while not self._waiting:
                    self._changed.wait()
                until_s, urb, respond = self._waiting[0]
                left_s = until_s - time.monotonic()
                if left_s > 0:
                    self._changed.wait(left_s)
                    continue
                del self._waiting[0]
                self.streaming.fill(urb)
                respond(urb)
