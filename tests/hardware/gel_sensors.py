"""An emulated GelSight Mini and an emulated DIGIT: webcams of these names, sizes and controls.

References
----------
.. [1] gsrobotics (GPL-3), issues 5 and 26: names, ids and nodes of a GelSight Mini.
.. [2] digit-interface (CC BY-NC 4.0): modes of a DIGIT, and its lights behind the zoom.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import count

import cv2
import numpy as np
from hardware.camera_model import Control, ControlSet, Mode, Model
from hardware.plugged import CAMERA, ZOOM
from hardware.webcam import Webcam

from tactile_core.profiles.loader import load_profile
from tactile_sim import VirtualStage

QUALITY = 90
"""JPEG quality at which an emulated C310's image takes as much as a real one's, 30 to 60 kB."""

MINI_SIZE, MINI_FPS = (3280, 2464), 25
QVGA, VGA = (320, 240), (640, 480)

_RENDERING = ThreadPoolExecutor(1)


def digit_controls() -> ControlSet:
    """Return the zoom: 4 bits for each light, of which at most 255 are reported."""
    return {(CAMERA, ZOOM): Control(2, 0, 0, 0xFFF, most_reported=0xFF)}


MINI_MODEL = Model(0x0C45, 0x636D, "Arducam Technology Co., Ltd.", "GelSight Mini R0B 2BNN-4ZE7")
DIGIT_MODEL = Model(0x2833, 0x0209, "", "DIGIT", "yuyv", digit_controls)


class Shown:
    """The same images again and again; they are rendered while the guest starts."""

    def __init__(self, render: Callable[[], list[bytes]]) -> None:
        self._images = _RENDERING.submit(render)
        self._number = count()

    def __call__(self, now_s: float) -> bytes:
        images = self._images.result()
        return images[next(self._number) % len(images)]


def jpeg(pixels: np.ndarray) -> bytes:
    """Compress an image, (H, W) grey or (H, W, 3) in the order R, G, B."""
    bgr = pixels[..., ::-1] if pixels.ndim == 3 else pixels[..., None].repeat(3, axis=2)
    return bytes(cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1])


@cache
def undeformed_and_pressed(profile: str) -> list[np.ndarray]:
    """Return two images of a virtual sensor, upright, cropped and in the order R, G, B."""
    stage = VirtualStage(profile)
    undeformed = stage.frame().pixels
    stage.indenter("sphere", diameter_mm=6)
    stage.press(depth_mm=0.4, steps=1, seconds=0.1)
    return [undeformed, stage.frame().pixels]


def gelsight_mini(serial: str) -> Webcam:
    """Return a GelSight Mini, which sees its gel within the crop of the profile."""

    def render() -> list[bytes]:
        crop = load_profile("gelsight_mini").image.crop
        assert crop is not None
        left, top, width, height = crop
        images = []
        for gel in undeformed_and_pressed("gelsight_mini"):
            whole = np.zeros((*MINI_SIZE[::-1], 3), np.uint8)
            whole[top : top + height, left : left + width] = cv2.resize(gel, (width, height))
            images.append(jpeg(whole))
        return images

    return Webcam(serial, MINI_MODEL, [Mode(*MINI_SIZE, (MINI_FPS,), Shown(render))])


def digit(serial: str) -> Webcam:
    """Return a DIGIT, whose camera lies on its side."""

    def render(size: tuple[int, int]) -> list[bytes]:
        images = [np.rot90(gel, -1) for gel in undeformed_and_pressed("digit")]
        return [
            cv2.cvtColor(cv2.resize(image, size), cv2.COLOR_RGB2YUV_YUY2).tobytes()
            for image in images
        ]

    modes = [
        Mode(*QVGA, (30, 60), Shown(lambda: render(QVGA))),
        Mode(*VGA, (15, 30), Shown(lambda: render(VGA))),
    ]
    return Webcam(serial, DIGIT_MODEL, modes)
