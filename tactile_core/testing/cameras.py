"""Checks of cameras: the images that they return and the time limit of a read."""

from __future__ import annotations

import time
from itertools import combinations, pairwise

import numpy as np

from tactile_core.errors import CameraTimeout
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.quantities import Image
from tactile_core.quantities.array_form import image_fault
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.devices import open_device
from tactile_core.testing.differences import (
    CannotCheck,
    Fault,
    depend_on,
    describe_error,
    report,
    report_errors,
)
from tactile_core.testing.imports import within
from tactile_core.testing.registered import Part

SLACK_S = 0.5  # How far a read may exceed its timeout on a busy machine, s

_READS = 4  # Images read in a row, to detect reused buffers and missed time limits

_PATIENCE_S = 5.0  # Timeout of reads that are expected to succeed, s


class CameraChecks(Suite):
    """The contract of :meth:`tactile_core.interfaces.camera.Camera.read`."""

    @check("camera")
    def test_image(self, part: Part) -> None:
        """A read returns an Image, uint8 or uint16, grey or RGB, always of the same size."""
        with (
            open_device(self.registered.device(part)) as camera,
            report_errors(
                part,
                "reading fails",
                why="there is nothing to measure",
                do="without the hardware, set options for an emulator",
            ),
        ):
            images = [_next(camera) for _ in range(3)]
        for image in images:
            report(
                part,
                _fault_of(image, images[0]),
                why="acquisition relies on this form when it crops, rotates and pairs images",
                do="return Image(pixels, timestamp_s, wall_time_s, sequence) with (H, W) or "
                "(H, W, 3) pixels in R, G, B order as uint8 or uint16",
            )

    @check("camera")
    def test_timestamps(self, part: Part) -> None:
        """Timestamps rise, on the monotonic clock of a live camera; sequence numbers increase."""
        with open_device(self.registered.device(part)) as camera, depend_on("image"):
            images = [_next(camera) for _ in range(3)]
            age_s = time.monotonic() - images[-1].timestamp_s
        for first, second in pairwise(images):
            fault = ""
            if second.timestamp_s < first.timestamp_s:
                fault = f"timestamp_s decreases from {first.timestamp_s} to {second.timestamp_s}"
            elif second.sequence <= first.sequence:
                fault = f"sequence goes from {first.sequence} to {second.sequence}"
            elif camera.live and not 0 <= age_s <= _PATIENCE_S + SLACK_S:
                fault = f"a new image is {'in the future' if age_s < 0 else f'{age_s:.1f} s old'}"
            report(
                part,
                fault,
                why="speed, slip, lost frames and the light of an image are computed from them",
                do="take time.monotonic() at mid-exposure, and count the images from 0",
            )

    @check("camera")
    def test_separate_images(self, part: Part) -> None:
        """An image keeps its pixels when the next image is read."""
        images, before = [], []
        with open_device(self.registered.device(part)) as camera, depend_on("image"):
            for _ in range(_READS):
                images.append(_next(camera).pixels)
                before.append(images[-1].copy())
        found = ""
        if any(np.shares_memory(a, b) for a, b in combinations(images, 2)):
            found = "two images share one buffer"
        elif not all(np.array_equal(a, b) for a, b in zip(images, before, strict=True)):
            found = "reading later images overwrites the pixels of an earlier one"
        report(
            part,
            found,
            why="a queued frame or a reference would change into a later frame",
            do="return a copy of the driver's buffer",
        )

    @check("camera")
    def test_arming(self, part: Part) -> None:
        """An open camera accepts its profile's exposures and returns a Trigger."""
        with open_device(self.registered.device(part)) as camera:
            try:
                for _ in range(2):
                    given = camera.arm(self.registered.exposures(part))
                found = "" if isinstance(given, Trigger) else f"arm() returns {given!r}"
                if not isinstance(camera.device_id, str):
                    found = f"its device_id is {camera.device_id!r}"
            except Exception as error:
                found = f"arm() fails ({describe_error(error)})"
        report(
            part,
            found,
            why="the Trigger defines whether the software or the camera advances the lights; "
            "device_id distinguishes two cameras of the same model",
            do="return a member of Trigger from _arm and a string from device_id, or define "
            "neither",
        )

    @check("camera")
    def test_time_limit(self, part: Part) -> None:
        """A read without an image raises CameraTimeout in timeout_s; None ends a recording.

        A camera that :meth:`stall` can stall is tested while it delivers nothing. Any other is
        read faster than it can deliver.
        """
        with open_device(self.registered.device(part)) as camera:
            stalled = self.stall(camera)
            for _ in range(1 if stalled else _READS):
                self._check_read(part, camera, 0.1 if stalled else 0.001, stalled)

    def _check_read(self, part: Part, camera: Camera, asked_s: float, stalled: bool) -> None:
        outcome = within(asked_s + 2 * SLACK_S, lambda: camera.read(asked_s))
        found = ""
        if not outcome.ended or outcome.took_s > asked_s + SLACK_S:
            waited = "" if outcome.ended else " and did not end"
            found = f"read(timeout_s={asked_s}) took {outcome.took_s:.2f} s{waited}"
        elif outcome.error is not None and not isinstance(outcome.error, CameraTimeout):
            found = f"read() raises {describe_error(outcome.error)} instead of CameraTimeout"
        elif outcome.error is None and stalled:
            given = type(outcome.value).__name__
            found = f"a stalled camera returns {given} instead of raising CameraTimeout"
        elif outcome.error is None and outcome.value is None and camera.read(_PATIENCE_S):
            found = "it returns images after None; None is the end of a recording"
        if found:
            raise Fault(
                part,
                found,
                why="a program that loses its camera hangs, or ends as if the recording were over",
                do="wait in _read for at most timeout_s, then raise "
                "tactile_core.errors.CameraTimeout",
            ) from outcome.error


def _next(camera: Camera) -> Image:
    image = camera.read(_PATIENCE_S)
    if image is None:
        raise CannotCheck("the recording is too short; set a longer one, or a loop, in options")
    if not isinstance(image, Image):
        raise TypeError(f"read() returns {type(image).__name__} instead of an Image")
    return image


def _fault_of(image: Image, first: Image) -> str:
    wrong = image_fault(image)
    if wrong:
        return f"it {wrong}"
    pixels = image.pixels
    if pixels.shape != first.pixels.shape:
        return f"its images change size, from {first.pixels.shape} to {pixels.shape}"
    return "its pixels are writable" if pixels.flags.writeable else ""
