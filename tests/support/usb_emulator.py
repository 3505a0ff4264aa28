"""Plugs an emulated light box into the USB of a command: usb_emulator.py FAULT COUNT -- COMMAND.

umockdev lets the command's unmodified libusb find the box and exchange requests with it. FAULT
(``none``, ``unplug`` or ``silence``) happens after the lights were set COUNT times. The last line
of the output is JSON: what the box was set to. Runs with the system's Python, which has gi.
"""

from __future__ import annotations

import errno
import json
import os
import struct
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import gi

sys.path.insert(0, str(Path(__file__).parents[1]))
gi.require_version("UMockdev", "1.0")
from gi.repository import GLib, UMockdev  # noqa: E402
from support.usb_light_box import UsbLightBox  # noqa: E402

NODE, BUS, NUMBER = "bus/usb/001/012", 1, 12
URB = struct.Struct("=BBxxiI4xQiiiiiIQ")
"""usbdevfs_urb: type, endpoint, status, flags, buffer, its length, actual length, and others."""
STATUS, LENGTH, ACTUAL = 2, 5, 6
"""Positions of fields of a URB."""

CONTROL = 2
"""Type of a URB for a control request."""


def _code(direction: int, number: int, size: int) -> int:
    return direction << 30 | size << 16 | ord("U") << 8 | number


CAPABILITIES, SUBMIT, DISCARD = _code(2, 26, 4), _code(2, 10, URB.size), 0x550B
REAP, REAP_NOW = _code(1, 12, 8), _code(1, 13, 8)
GET_DRIVER = _code(1, 8, 260)
DONE = {_code(2, 15, 4), _code(2, 16, 4), _code(2, 5, 4), _code(2, 4, 8), _code(2, 27, 264), 0x5514}
"""Claim, release, set configuration and alternate setting, disconnect, reset."""


class Bus:
    """The requests of every client, answered by the box."""

    def __init__(self, box: UsbLightBox, fault: str, after: int) -> None:
        self.box, self.fault, self.after = box, fault, after
        self.pending: list[tuple[Any, Any, list[Any], int]] = []
        self.testbed = UMockdev.Testbed.new()
        self.handler = UMockdev.IoctlBase.new()
        self.handler.connect("handle-ioctl", self.ioctl)
        self.testbed.attach_ioctl(f"/dev/{NODE}", self.handler)
        descriptors = (box.device_descriptor + box.configuration).hex()
        vendor, product = box.ids
        self.path = f"/devices/pci0000:00/0000:00:14.0/usb{BUS}/{BUS}-{box.port}"
        self.testbed.add_from_string(
            f"P: {self.path}\nN: {NODE}\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: DEVTYPE=usb_device\n"
            f"E: BUSNUM={BUS:03}\nE: DEVNUM={NUMBER:03}\nE: DEVNAME=/dev/{NODE}\n"
            f"A: busnum={BUS}\\n\nA: devnum={NUMBER}\\n\nA: speed=12\\n\n"
            f"A: bConfigurationValue=1\\n\nA: idVendor={vendor:04x}\\n\n"
            f"A: idProduct={product:04x}\\n\nH: descriptors={descriptors}\n"
        )

    def ioctl(self, _: object, client: Any) -> bool:
        request, argument = client.get_request() & 0xFFFFFFFF, client.get_arg()
        if self.box.gone:
            client.complete(-1, errno.ENODEV)
        elif request == CAPABILITIES:
            argument.resolve(0, 4).update(0, struct.pack("I", 0))
            client.complete(0, 0)
        elif request in DONE:
            client.complete(0, 0)
        elif request == GET_DRIVER:
            client.complete(-1, errno.ENODATA)
        elif request == SUBMIT:
            urb = argument.resolve(0, URB.size)
            fields = list(URB.unpack(bytes(urb.retrieve())))
            self.pending.append((urb, urb.resolve(16, fields[LENGTH]), fields, hash(client)))
            client.complete(0, 0)
        elif request in (REAP, REAP_NOW):
            done = self.finished(hash(client))
            if done is None:
                client.complete(-1, errno.EAGAIN)
            else:
                argument.resolve(0, 8).set_ptr(0, done)
                client.complete(0, 0)
        elif request == DISCARD:
            address = struct.unpack("Q", bytes(argument.retrieve()))[0]
            found = [urb for urb in self.pending if urb[0].client_addr == address]
            for urb in found:
                urb[2][STATUS] = -errno.ENOENT
            client.complete(0 if found else -1, 0 if found else errno.EINVAL)
        else:
            return False
        return True

    def finished(self, client: int) -> Any:
        """Answer a pending request of a client, and return its URB; None if there is none."""
        for entry in self.pending:
            urb, buffer, fields, owner = entry
            if owner != client:
                continue
            if fields[STATUS] != -errno.ENOENT:
                if self.box.silent:
                    continue
                self.answer(buffer, fields)
            self.pending.remove(entry)
            urb.update(0, URB.pack(*fields))
            return urb
        return None

    def answer(self, buffer: Any, fields: list[Any]) -> None:
        data = bytes(buffer.retrieve())
        kind, request, value, _, length = struct.unpack("<BBHHH", data[:8])
        out = b"" if kind & 0x80 else data[8 : 8 + length]
        answer = self.box.control(kind, request, value, out) if fields[0] == CONTROL else None
        if answer is None:
            fields[STATUS], fields[ACTUAL] = -errno.EPIPE, 0
            return
        answer = answer[:length]
        if kind & 0x80:
            buffer.update(8, answer)
        fields[STATUS], fields[ACTUAL] = 0, len(answer) if kind & 0x80 else length
        if len(self.box.levels) == self.after:
            self.begin_fault()

    def begin_fault(self) -> None:
        self.box.silent = self.fault == "silence"
        if self.fault == "unplug" and not self.box.gone:
            self.box.gone = True
            self.testbed.uevent(f"/sys{self.path}", "remove")
            self.testbed.remove_device(f"/sys{self.path}")


def main() -> int:
    fault, after, _, *command = sys.argv[1:]
    bus = Bus(UsbLightBox(port=2), fault, int(after))
    loop = GLib.MainLoop()
    threading.Thread(target=loop.run, daemon=True).start()
    environment = os.environ | {
        "LD_PRELOAD": "libumockdev-preload.so.0",
        "UMOCKDEV_DIR": bus.testbed.get_root_dir(),
    }
    code = subprocess.run(command, env=environment, check=False).returncode
    print(json.dumps({"levels": bus.box.levels, "beats": bus.box.beats}), flush=True)
    loop.quit()
    return code


if __name__ == "__main__":
    sys.exit(main())
