"""A webcam's compressed images at 30 Hz through the whole chain; with ``make soak``."""

from __future__ import annotations

import time
from threading import Event
from typing import Any

import cv2
import numpy as np
import pytest

from tactile_core import HeightMap, MarkerField, SlipState, load_profile, open_sensor
from tactile_core.builtin.cameras.uvc_camera import UvcCamera
from tactile_core.calibration.virtual_unit import virtual_unit
from tactile_core.errors import CameraTimeout
from tactile_core.interfaces.streaming.encoded_image import EncodedImage, encoded_image
from tactile_core.interfaces.streaming.streaming_camera import ImageSource
from tactile_sim import VirtualStage

FPS, FRAMES = 30, 900
BUFFERS = 10
"""Images that the driver holds; it leaves out those that come while all are full."""

WAITING = 5 * FPS
"""Most images that may wait in the queue: the chain keeps up, apart from pauses."""

WARM_UP = 10 * FPS
"""Readings at most until the queue is empty for the first time."""

pytestmark = [pytest.mark.soak, pytest.mark.timeout(900)]


def slipping(count: int) -> list[bytes]:
    """JPEGs of the fingertip: a flat object presses, is pushed until it slips, and goes back."""
    stage = VirtualStage("hex_fingertip")
    images = [stage.frame()]
    stage.indenter("flat", diameter_mm=8)
    stage.press(depth_mm=0.3, steps=1, seconds=0.1)
    while len(images) < count:
        stage.shear(dx_mm=0.05, seconds=1 / FPS)
        images.append(stage.frame())
    quality = [cv2.IMWRITE_JPEG_QUALITY, 90]
    there = [bytes(cv2.imencode(".jpg", one.pixels[..., ::-1], quality)[1]) for one in images]
    return [*there, *there[-2:0:-1]]


class Driver(ImageSource):
    """Gives images as a webcam's driver does: at their time, from a few buffers.

    Attributes
    ----------
    grabbed, left_out : int
    """

    def __init__(self, images: list[bytes]) -> None:
        self.grabbed = self.left_out = 0
        self._images = images
        self._begun_s = time.monotonic()
        self._interrupted = Event()

    def grab(self) -> EncodedImage | None:
        """Wait for the next image."""
        number = self.grabbed + self.left_out
        full = int((time.monotonic() - self._begun_s) * FPS) - number - BUFFERS
        if full > 0:
            self.left_out += full
            number += full
        due_s = self._begun_s + (number + 1) / FPS
        if self._interrupted.wait(max(0.0, due_s - time.monotonic())):
            raise CameraTimeout("interrupted")
        self.grabbed += 1
        return encoded_image(self._images[number % len(self._images)], due_s, "the webcam")

    def interrupt(self) -> None:
        self._interrupted.set()

    def close(self) -> None:
        """Nothing to release."""


def test_no_image_is_lost_through_the_whole_chain(monkeypatch: pytest.MonkeyPatch) -> None:
    images = slipping(60)
    drivers: list[Driver] = []

    def connect(_: Any) -> Driver:
        drivers.append(Driver(images))
        return drivers[-1]

    monkeypatch.setattr(UvcCamera, "_connect", connect)
    profile = load_profile("hex_fingertip", overrides={"camera": {"use": "core.uvc"}})
    unit = virtual_unit(profile, size_px=(640, 480))
    stamps_s, waiting, took_ms, moved_mm, states = [], [], [], [], set[str]()
    with open_sensor(unit.profile, bundle=unit.bundle, reference="first") as sensor:
        stream = sensor.stream(drop="never")
        driver = drivers[-1]
        # the first reading loads code, which stops all threads for a second
        for _, reading in zip(range(WARM_UP), stream, strict=False):
            if reading.frame.sequence == driver.grabbed - 1:
                break
        left_out = driver.left_out
        for _ in range(FRAMES):
            reading = next(stream)
            stamps_s.append(reading.frame.timestamp_s)
            waiting.append(driver.grabbed - 1 - reading.frame.sequence)
            took_ms.append(reading.latency_ms)
            assert HeightMap in reading
            moved_mm.append(np.linalg.norm(reading[MarkerField].displacement_mm, axis=1).max())
            states.add(reading[SlipState].state)
        left_out = driver.left_out - left_out
    lost = int(np.rint(np.diff(stamps_s) * FPS - 1).sum())
    print(
        f"{lost} of {FRAMES} images lost at {(FRAMES - 1) / (stamps_s[-1] - stamps_s[0]):.2f} Hz, "
        f"at most {max(waiting)} were waiting; median latency {np.median(took_ms):.1f} ms; "
        f"markers moved by up to {max(moved_mm):.2f} mm; slip states: {', '.join(sorted(states))}"
    )
    assert (lost, left_out) == (0, 0)
    assert max(waiting) <= WAITING
    assert max(moved_mm) > 0.3
    assert "slip" in states
