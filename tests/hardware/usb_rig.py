"""Emulated devices on a USB/IP server, and a control port through which a test disturbs them.

Run on this computer with the two ports as arguments; a guest's kernel attaches the devices.
"""

from __future__ import annotations

import json
import socket
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from itertools import count

import cv2
import numpy as np
from hardware.cdc_light_box import CdcLightBox
from hardware.plugged import BOX, FIRST, HEIGHT, LIT, LIT_SCALE, WIDTH
from hardware.webcam import Webcam
from support.virtual_bench import COLUMNS, ROWS, Scene, Timing
from usbip.transport import USBIP

from tactile_sim import VirtualStage

PRESSED = 12
"""Different images of the gel, which are sent again and again."""

QUALITY = 90
"""JPEG quality at which an image of the gel takes about as much as a C310's, 30 to 60 kB."""

TIMING = Timing(stamp_s=0.038)
"""Of the webcam that sees the lights: it sends an image once its last row is read out."""


def jpeg(pixels: np.ndarray) -> bytes:
    """Compress an image, (H, W) grey or (H, W, 3) in the order R, G, B."""
    bgr = pixels[..., ::-1] if pixels.ndim == 3 else pixels[..., None].repeat(3, axis=2)
    return bytes(cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1])


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


class GelView:
    """What the first webcam sees; rendered while the guest starts."""

    def __init__(self) -> None:
        self._images = ThreadPoolExecutor().submit(of_a_gel)
        self._number = count()

    def __call__(self, now_s: float) -> bytes:
        images = self._images.result()
        return images[next(self._number) % len(images)]


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
        FIRST: Webcam(FIRST, WIDTH, HEIGHT, GelView(), interval=3),
        LIT: Webcam(LIT, COLUMNS * LIT_SCALE, ROWS * LIT_SCALE, LitView(scene), interval=2),
        BOX: CdcLightBox(scene),
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
