"""Emulated devices on a USB/IP server, and a control port through which a test disturbs them.

Run on this computer with the two ports as arguments; a guest's kernel attaches the devices.
"""

from __future__ import annotations

import json
import socket
import sys
import threading

import numpy as np
from hardware.camera_model import C310, Mode
from hardware.cdc_light_box import CdcLightBox
from hardware.gel_sensors import Shown, digit, gelsight_mini, jpeg
from hardware.plugged import BOX, DIGITS, FIRST, FPS, HEIGHT, LIT, LIT_SCALE, MINI, WIDTH
from hardware.webcam import Webcam
from support.virtual_bench import COLUMNS, ROWS, Scene, Timing
from usbip.transport import USBIP

from tactile_sim import VirtualStage

PRESSED = 12
"""Different images of the gel, which are sent again and again."""

LIT_SIZE = (COLUMNS * LIT_SCALE, ROWS * LIT_SCALE)

TIMING = Timing(stamp_s=0.038)
"""Of the webcam that sees the lights: it sends an image once its last row is read out."""


def of_a_gel() -> list[bytes]:
    """Images of the virtual fingertip: an object presses and is pushed sideways."""
    stage = VirtualStage("hex_fingertip")
    images = [stage.frame()]
    stage.indenter("sphere", diameter_mm=6)
    stage.press(depth_mm=0.4, steps=1, seconds=0.1)
    while len(images) < PRESSED:
        stage.shear(dx_mm=0.05, seconds=1 / 30)
        images.append(stage.frame())
    assert images[0].pixels.shape == (HEIGHT, WIDTH, 3)
    return [jpeg(image.pixels) for image in images]


class LitView:
    """What the second webcam sees: the lights that were on while each row was exposed."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def __call__(self, now_s: float) -> bytes:
        rows_s = np.linspace(0, TIMING.readout_s, ROWS)
        pixels = self._scene.picture(now_s - TIMING.stamp_s + rows_s, TIMING.exposure_s)
        return jpeg(np.kron(pixels, np.ones((LIT_SCALE, LIT_SCALE), np.uint8)))


def serve(usb_port: int, control_port: int) -> None:
    """Serve the devices and answer requests, one JSON list a line, until the input ends."""
    scene = Scene()
    devices = {
        FIRST: Webcam(FIRST, C310, [Mode(WIDTH, HEIGHT, (FPS,), Shown(of_a_gel))], interval=3),
        LIT: Webcam(LIT, C310, [Mode(*LIT_SIZE, (FPS,), LitView(scene))], interval=2),
        BOX: CdcLightBox(scene),
        MINI: gelsight_mini(MINI),
        **{serial: digit(serial) for serial in DIGITS},
    }
    transport = USBIP("127.0.0.1", usb_port)
    for device in devices.values():
        device.plug(via=transport)
    server = socket.create_server(("127.0.0.1", control_port))

    def answer(connection: socket.socket) -> None:
        with connection, connection.makefile("rw") as lines:
            for line in lines:
                serial, what, *values = json.loads(line)
                print(json.dumps(devices[serial].asked(what, *values)), file=lines, flush=True)

    def accept() -> None:
        while True:
            connection, _ = server.accept()
            threading.Thread(target=answer, args=(connection,), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    print("serving", flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    serve(int(sys.argv[1]), int(sys.argv[2]))
