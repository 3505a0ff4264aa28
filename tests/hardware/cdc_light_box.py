"""An emulated box of lights at a USB serial port, with the watchdog of the firmware."""

from __future__ import annotations

import time
from threading import Thread
from typing import Any

import numpy as np
from hardware.plugged import BOX
from support.virtual_bench import LIGHTS, Scene
from usbip.classes.device.cdc_acm import CDCACM
from usbip.device import USBDevice

from tactile_core.builtin.leds.led_box import FULL, LineError, decode, encode

SETTLE_S, WATCHDOG_S = 0.001, 2.0


class CdcLightBox(USBDevice):  # type: ignore[misc]
    """Speaks the light protocol and changes the lights of a scene."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(0x2341, 0x0043, product="Tactile lights", serial=BOX)
        self._scene = scene
        self._received = b""
        self._heard_s = 0.0
        self.add(CDCACM(on_rx=self._hear, on_open=self._greet))
        Thread(target=self._watch, daemon=True).start()

    def asked(self, what: str) -> object:
        """Say which lights are on."""
        assert what == "levels"
        return [float(level) for level in self._scene.changes[-1][1]]

    def _greet(self, port: Any, _: object) -> None:
        port.write(self._hello(0))

    def _hello(self, number: str | int) -> bytes:
        settle_ms, watchdog_ms = round(1e3 * SETTLE_S), round(1e3 * WATCHDOG_S)
        rest = f"1 tactile-lights 1.0 {BOX} {len(LIGHTS)} {settle_ms} {watchdog_ms}"
        return encode("HELLO", number, *rest.split())

    def _hear(self, port: Any, data: bytes) -> None:
        *lines, self._received = (self._received + data).split(b"\n")
        for line in filter(bytes.strip, lines):
            try:
                words = decode(line)
            except LineError:
                port.write(encode("ERR", 0, "CHECKSUM"))
                continue
            port.write(self._answer(*words))

    def _answer(self, command: str, number: str, *levels: str) -> bytes:
        self._heard_s = time.monotonic()
        if command == "HELLO":
            return self._hello(number)
        if command == "SET":
            self._shine(np.array([int(level) for level in levels]) / FULL)
            time.sleep(SETTLE_S)
        return encode("OK", number)

    def _shine(self, levels: np.ndarray) -> None:
        self._scene.changes.append((time.monotonic(), levels))

    def _watch(self) -> None:
        while True:
            time.sleep(WATCHDOG_S / 10)
            lit = self._scene.changes[-1][1].any()
            if lit and time.monotonic() - self._heard_s > WATCHDOG_S:
                self._shine(np.zeros(len(LIGHTS)))
