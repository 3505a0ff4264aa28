"""Attaches devices of a USB/IP server to the kernel's virtual host controller; needs root."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from hardware.plugged import WEBCAMS

from tactile_core.builtin.cameras.video_nodes import video_nodes

CONTROLLER = Path("/sys/devices/platform/vhci_hcd.0")
_VERSION, _IMPORT = 0x0111, 0x8003
_HIGH_SPEED, _FREE = "hs", "004"
_PLUG_PATIENCE_S = 60.0


class Bus:
    """The devices of one server, plugged in and out by their bus id."""

    def __init__(self, host: str, usb_port: int, control_port: int) -> None:
        self._host, self._usb_port = host, usb_port
        self._ports: dict[str, int] = {}
        self._control = socket.create_connection((host, control_port), timeout=20)
        self._lines = self._control.makefile("rw")

    def is_plugged(self, bus_id: str) -> bool:
        """Whether a device is attached."""
        return bus_id in self._ports

    def plug(self, bus_id: str) -> None:
        """Attach a device; its driver needs a moment to notice."""
        connection = socket.create_connection((self._host, self._usb_port), timeout=20)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.sendall(struct.pack(">HHI32s", _VERSION, _IMPORT, 0, bus_id.encode()))
        reply = b""
        while len(reply) < 8 + 312:
            reply += connection.recv(320 - len(reply))
        bus, number, speed = struct.unpack_from(">III", reply, 8 + 256 + 32)
        port = self._free_port()
        device = bus << 16 | number
        connection.settimeout(None)
        attach = f"{port} {connection.fileno()} {device} {speed}"
        (CONTROLLER / "attach").write_text(attach)
        self._ports[bus_id] = port
        connection.close()  # the kernel has it now

    def unplug(self, bus_id: str) -> None:
        """Detach a device."""
        (CONTROLLER / "detach").write_text(str(self._ports.pop(bus_id)))

    def ask(self, serial: str, what: str, *values: int) -> object:
        """Disturb a device, or ask for its state."""
        print(json.dumps([serial, what, *values]), file=self._lines, flush=True)
        return json.loads(self._lines.readline())

    def close(self) -> None:
        """Detach all devices."""
        for bus_id in list(self._ports):
            with contextlib.suppress(OSError):
                self.unplug(bus_id)
        self._lines.close()
        self._control.close()

    def _free_port(self) -> int:
        for _ in range(100):
            for line in (CONTROLLER / "status").read_text().splitlines()[1:]:
                hub, port, state, *_ = line.split()
                if hub == _HIGH_SPEED and state == _FREE:
                    return int(port)
            time.sleep(0.1)
        raise OSError("no port of the virtual controller is free")


def webcams_are_there(more: Sequence[str] = ()) -> bool:
    """Whether both webcams, and these further cameras, have device files that open."""
    nodes = video_nodes()
    there = {node.serial for node in nodes} == {*WEBCAMS, *more}
    return there and all(_opens(node.path) for node in nodes)


def _opens(path: str) -> bool:
    try:
        os.close(os.open(path, os.O_RDWR | os.O_NONBLOCK))
    except OSError:  # absent, or busy as long as the hub has others to attach or to detach
        return False
    return True


def wait_for(condition: Callable[[], object]) -> None:
    """Wait until the kernel and the drivers are that far."""
    until = time.monotonic() + _PLUG_PATIENCE_S
    while not condition():
        assert time.monotonic() < until, f"waited in vain for {condition}"
        time.sleep(0.02)
