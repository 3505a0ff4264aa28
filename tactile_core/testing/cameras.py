"""Checks of cameras: the images that they return and the time limit of a read."""

from __future__ import annotations

import time
from itertools import combinations, pairwise

import numpy as np

from tactile_core.errors import CameraTimeout, DeviceError
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.quantities import Image
from tactile_core.quantities.array_form import image_fault
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.devices import open_device
from tactile_core.testing.differences import CannotCheck, Fault
from tactile_core.testing.imports import within
from tactile_core.testing.registered import Part, Registered

SLACK_S = 0.5  # How far a read may exceed its timeout on a busy machine, s

_READS = 4  # Images read in a row, to detect reused buffers and missed time limits

_PATIENCE_S = 5.0  # Timeout of reads that are expected to succeed, s

_AT_ONCE_S = 0.001  # Timeout that a running camera cannot meet, s

_STALLED_S = 0.1  # Timeout of a read from a stalled camera, s


class CameraChecks(Suite):
    """The contract of :meth:`tactile_core.interfaces.camera.Camera.read`."""

    @check(Registered.cameras)
    def test_image(self, part: Part) -> None:
        """A read returns an Image, uint8 or uint16, grey or RGB, always of the same size."""
        images = self._read(part, 3, report=True)
        for image in images:
            wrong = _fault_of(image, images[0])
            if wrong:
                raise Fault(
                    part,
                    wrong,
                    why="acquisition relies on this form when it crops, rotates and pairs images",
                    do="return Image(pixels, timestamp_s, wall_time_s, sequence) with (H, W) or "
                    "(H, W, 3) pixels in R, G, B order as uint8 or uint16",
                )

    @check(Registered.cameras)
    def test_timestamps(self, part: Part) -> None:
        """Timestamps never decrease, and sequence numbers increase."""
        for first, second in pairwise(self._read(part, 3)):
            if second.timestamp_s < first.timestamp_s:
                fault = f"timestamp_s decreases from {first.timestamp_s} to {second.timestamp_s}"
                do = "take time.monotonic() at mid-exposure"
            elif second.sequence <= first.sequence:
                fault = f"sequence goes from {first.sequence} to {second.sequence}"
                do = "count the images from 0"
            else:
                continue
            why = "speed, slip and lost frames are computed from them"
            raise Fault(part, fault, why=why, do=do)

    @check(Registered.cameras)
    def test_latest(self, part: Part) -> None:
        """The latest image of a live camera is as new as requested, on the monotonic clock."""
        with open_device(self.registered.device(part)) as camera:
            self._next(camera)
            if not camera.live:
                raise CannotCheck("the camera is not live, so its images may be old")
            try:
                image = camera.latest(_PATIENCE_S)
            except CameraTimeout as error:
                raise CannotCheck(f"the camera sends too few images: {error}") from error
            age_s = time.monotonic() - (0.0 if image is None else image.timestamp_s)
        if image is None or 0 <= age_s <= _PATIENCE_S + SLACK_S:
            return
        raise Fault(
            part,
            "its latest image "
            + ("is in the future" if age_s < 0 else f"is {age_s:.1f} s old instead of at most 5 s"),
            why="a controller would act on an image of the past, and images cannot be assigned to "
            "the lights that were on",
            do="give each image the time.monotonic() of its exposure, and do not override latest()",
        )

    @check(Registered.cameras)
    def test_separate_images(self, part: Part) -> None:
        """An image keeps its pixels when the next image is read."""
        images, before = [], []
        with open_device(self.registered.device(part)) as camera:
            for _ in range(_READS):
                images.append(self._next(camera).pixels)
                before.append(images[-1].copy())
        found = ""
        if any(np.shares_memory(a, b) for a, b in combinations(images, 2)):
            found = "two images share one buffer"
        elif not all(np.array_equal(a, b) for a, b in zip(images, before, strict=True)):
            found = "reading later images overwrites the pixels of an earlier one"
        if found:
            raise Fault(
                part,
                found,
                why="a queued frame or a reference would change into a later frame",
                do="return a copy of the driver's buffer",
            )

    @check(Registered.cameras)
    def test_reading_closed(self, part: Part) -> None:
        """Reading a closed camera raises DeviceError, before opening and after closing."""
        camera = self.registered.device(part)
        assert isinstance(camera, Camera)
        for when in ("before it is opened", "after it was closed"):
            try:
                camera.read()
            except DeviceError:
                pass
            except Exception as error:
                raise Fault(
                    part,
                    f"reading {when} raises {type(error).__name__}: {error}",
                    why="programs that handle DeviceError fail with another exception",
                    do="do not override read(); it guards _read()",
                ) from error
            else:
                raise Fault(
                    part,
                    f"reading {when} returns a value",
                    why="a program that forgets to open the camera would measure invalid images",
                    do="do not override read(); it guards _read()",
                )
            open_device(camera).close()

    @check(Registered.cameras)
    def test_arming(self, part: Part) -> None:
        """An open camera accepts its profile's exposures and returns a Trigger."""
        camera = self.registered.device(part)
        assert isinstance(camera, Camera)
        with open_device(camera):
            try:
                for _ in range(2):
                    given = camera.arm(self.registered.exposures(part))
                found = "" if isinstance(given, Trigger) else f"arm() returns {given!r}"
                if not isinstance(camera.device_id, str):
                    found = f"its device_id is {camera.device_id!r}"
            except Exception as error:
                found = f"arm() fails ({type(error).__name__}: {error})"
            if found:
                raise Fault(
                    part,
                    found,
                    why="the Trigger defines whether the software or the camera advances the "
                    "lights; device_id distinguishes two cameras of the same model",
                    do="return a member of Trigger from _arm and a string from device_id, or "
                    "define neither",
                )

    @check(Registered.cameras)
    def test_time_limit(self, part: Part) -> None:
        """A read without an image raises CameraTimeout in timeout_s; None ends a recording.

        A camera that :meth:`stall` can stall is tested while it delivers nothing. Any other is
        read faster than it can deliver.
        """
        with open_device(self.registered.device(part)) as camera:
            stalled = self.stall(camera)
            asked_s = _STALLED_S if stalled else _AT_ONCE_S
            for _ in range(1 if stalled else _READS):
                self._check_read(part, camera, asked_s, stalled)

    def _check_read(self, part: Part, camera: Camera, asked_s: float, stalled: bool) -> None:
        outcome = within(asked_s + 2 * SLACK_S, lambda: camera.read(asked_s))
        found = ""
        if not outcome.ended or outcome.took_s > asked_s + SLACK_S:
            waited = "" if outcome.ended else " and did not end"
            found = f"read(timeout_s={asked_s}) took {outcome.took_s:.2f} s{waited}"
        elif outcome.error is not None and not isinstance(outcome.error, CameraTimeout):
            found = (
                f"read(timeout_s={asked_s}) raises {type(outcome.error).__name__} "
                f"({outcome.error}) instead of CameraTimeout"
            )
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

    def _read(self, part: Part, count: int, *, report: bool = False) -> list[Image]:
        with open_device(self.registered.device(part)) as camera:
            try:
                return [self._next(camera) for _ in range(count)]
            except CannotCheck as skipped:
                if not report or skipped.__cause__ is None:
                    raise
                error = skipped.__cause__
                raise Fault(
                    part,
                    f"reading fails ({type(error).__name__}: {error})",
                    why="there is nothing to measure",
                    do="without the hardware, set options for an emulator",
                ) from error

    def _next(self, camera: Camera) -> Image:
        try:
            image = camera.read(_PATIENCE_S)
            if not isinstance(image, Image | None):
                raise TypeError(f"read() returns {type(image).__name__} instead of an Image")
        except Exception as error:
            raise CannotCheck(f"see the check 'image': {error}") from error
        if image is None:
            raise CannotCheck("the recording is too short; set a longer one, or a loop, in options")
        return image


def _fault_of(image: Image, first: Image) -> str:
    wrong = image_fault(image)
    if wrong:
        return f"it {wrong}"
    pixels = image.pixels
    if pixels.shape != first.pixels.shape:
        return f"its images change size, from {first.pixels.shape} to {pixels.shape}"
    if pixels.flags.writeable:
        return "its pixels are writable"
    return ""
