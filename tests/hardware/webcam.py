"""An emulated webcam, which begins an image only after it has sent the one before whole."""

from __future__ import annotations

import struct
import time
from collections.abc import Sequence
from itertools import count
from threading import Condition, Thread
from typing import Any

from hardware.camera_model import ControlSet, Mode, Model
from hardware.plugged import CAMERA, PROCESSING, ZOOM, numbered, shaded
from usbip.classes.device.uvc import (
    CS_INTERFACE,
    STREAM_EOF,
    STREAM_FID,
    UVC,
    VS_FORMAT_MJPEG,
    VS_FORMAT_UNCOMP,
    VS_FRAME_MJPEG,
    VS_FRAME_UNCOMP,
    YUY2_GUID,
    VideoControl,
    VideoStreaming,
    _interface,
)
from usbip.core import SPEED_HIGH, Stall
from usbip.device import USBDevice

_SET = 0x01
_GET_LENGTH, _GET_INFO = 0x85, 0x86
_FIELDS = {0x81: "reported", 0x82: "lowest", 0x83: "highest", 0x84: "step", 0x87: "default"}
"""Requests GET_CUR, GET_MIN, GET_MAX, GET_RES and GET_DEF (UVC 1.0, table A-8)."""

_BITS = {
    (CAMERA, 0x02): 1,
    (CAMERA, 0x04): 3,
    (CAMERA, ZOOM): 9,
    (PROCESSING, 0x04): 9,
    (PROCESSING, 0x0A): 6,
    (PROCESSING, 0x0B): 12,
}
"""Bits by which the units say which controls they have (UVC 1.0, tables 3-6 and 3-8)."""

_SET_INTERFACE, _NO_SPACE = b"\x01\x0b", -28
"""First bytes of that request (USB 2.0, section 9.4.10), and Linux's status of a full bus."""

_MICROFRAME_S = 125e-6
_TRANSACTION_BYTES, _TRANSACTIONS = 1024, 3
"""Of an isochronous packet at high speed, at most (USB 2.0, section 5.6.3)."""


class Controls(VideoControl):  # type: ignore[misc]
    """The controls of a camera's units."""

    def __init__(self, controls: ControlSet) -> None:
        super().__init__()
        self.controls = controls

    def descriptor_block(self) -> bytes:
        own, streaming = self.interface_number, self.interface_number + 1
        camera, processing = (
            sum(1 << _BITS[control] for control in self.controls if control[0] == unit)
            for unit in (CAMERA, PROCESSING)
        )
        units = struct.pack("<BBBBHBBHHHB", 18, CS_INTERFACE, 2, 1, 0x0201, 0, 0, 0, 0, 0, 3)
        units += camera.to_bytes(3, "little")
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
            return bytes((control.info,))
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

    def __init__(self, modes: Sequence[Mode], format: str, interval: int) -> None:
        first = modes[0]
        super().__init__(first.width, first.height, first.rates[0], (format,))
        self.packet_s = _MICROFRAME_S * 2 ** (interval - 1)
        self.sent = self.skipped = self.torn = 0
        self.stalled = False
        self._modes, self._format, self._interval = modes, format, interval
        self._begun = 0
        self._due_s = 0.0

    @property
    def mode(self) -> Mode:
        """What the host has chosen."""
        return self._modes[self.cur_frame - 1]

    @property
    def rate_hz(self) -> float:
        """Images a second that the host has chosen."""
        return 1e7 / float(self.cur_interval)

    def on_control(self, setup: Any, data: bytes = b"") -> bytes:
        answer = bytes(super().on_control(setup, data))
        self.max_frame_size = self.mode.bytes
        return answer

    def _format_blocks(self) -> bytes:
        number = len(self._modes)
        if self._format == "mjpeg":
            kind, head = VS_FRAME_MJPEG, (11, CS_INTERFACE, VS_FORMAT_MJPEG, 1, number)
            block = bytes((*head, 0, 1, 0, 0, 0, 0))
        else:
            kind, head = VS_FRAME_UNCOMP, (27, CS_INTERFACE, VS_FORMAT_UNCOMP, 1, number)
            block = bytes((*head, *YUY2_GUID, 16, 1, 0, 0, 0, 0))
        for index, mode in enumerate(self._modes, 1):
            periods = [10_000_000 // rate for rate in mode.rates]
            rates = [8 * mode.bytes * rate for rate in (min(mode.rates), max(mode.rates))]
            block += struct.pack(
                f"<BBBBBHHIIIIB{len(periods)}I",
                26 + 4 * len(periods),
                *(CS_INTERFACE, kind, index, 0, mode.width, mode.height, *rates, mode.bytes),
                *(periods[0], len(periods), *periods),
            )
        return block + struct.pack("<BBBBBB", 6, CS_INTERFACE, 0x0D, 1, 1, 4)

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
        periods = int((now_s - self._due_s) * self.rate_hz)
        self.skipped += periods
        self._due_s += (periods + 1) / self.rate_hz
        picture, width = self.mode.picture(now_s), self.mode.width
        compressed = self._format == "mjpeg"
        marked = (
            numbered(picture, self._begun) if compressed else shaded(picture, width, self._begun)
        )
        self._frame, self._pos = marked, 0
        if self.torn:
            self.torn -= 1
            self._frame = self._frame[: len(self._frame) // 2]
        self._begun += 1
        return True


class Webcam(USBDevice):  # type: ignore[misc]
    """A webcam of some model.

    Parameters
    ----------
    serial : str
    model : Model
    modes : sequence of Mode
    interval : int
        ``bInterval`` of its endpoint. The kernel asks for 32 packets at a time: a larger interval
        means fewer requests, and coarser timestamps.

    Attributes
    ----------
    crowded : bool
        Whether the bus has no bandwidth left for its images.
    """

    def __init__(self, serial: str, model: Model, modes: Sequence[Mode], interval: int = 1) -> None:
        super().__init__(
            model.vendor_id,
            model.product_id,
            manufacturer=model.manufacturer,
            product=model.product,
            serial=serial,
        )
        self.set_speed(SPEED_HIGH)
        function = UVC()
        self.controls = Controls(model.controls())
        self.streaming = Streaming(modes, model.format, interval)
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
        elif what == "power":  # lost, as at each unplugging
            for control in self.controls.controls.values():
                control.value = control.default
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
