"""Checks of cameras: what an exposure must be, and how long one may take."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np

from tactile_core.errors import CameraTimeout, DeviceError
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.quantities import Image
from tactile_core.quantities.array_form import image_fault
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.devices import opened
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.footprint import within
from tactile_core.testing.registered import Part, Registered

SLACK_S = 0.5
"""How much longer than asked a read may take, on a busy machine."""

_READS, _PATIENCE_S, _AT_ONCE_S, _STALLED_S = 4, 5.0, 0.001, 0.1


class CameraChecks(Suite):
    """The contract of :meth:`tactile_core.interfaces.camera.Camera.read`."""

    @check(Registered.cameras)
    def test_image(self, part: Part) -> None:
        """A read gives an Image of bytes or 16-bit values, grey or RGB, of one size."""
        images = self._read(part, 3, judged=True)
        for image in images:
            wrong = _what_is_wrong_with(image, images[0])
            if wrong:
                raise Fault(
                    part,
                    wrong,
                    why="acquisition crops, turns and pairs images by what the interface promises",
                    do="return Image(pixels, timestamp_s, wall_time_s, sequence) with (H, W) or "
                    "(H, W, 3) pixels in R, G, B order as uint8 or uint16",
                )

    @check(Registered.cameras)
    def test_clock(self, part: Part) -> None:
        """Timestamps never run backwards, and sequence numbers rise."""
        for first, second in pairwise(self._read(part, 3)):
            if second.timestamp_s < first.timestamp_s:
                fault = f"timestamp_s goes back from {first.timestamp_s} to {second.timestamp_s}"
                do = "take time.monotonic() at mid-exposure"
            elif second.sequence <= first.sequence:
                fault = f"sequence goes from {first.sequence} to {second.sequence}"
                do = "count the images from 0"
            else:
                continue
            why = "speeds, slip and lost frames are told by them"
            raise Fault(part, fault, why=why, do=do)

    @check(Registered.cameras)
    def test_own_pixels(self, part: Part) -> None:
        """An image keeps its pixels when the next one is read."""
        images, before = [], []
        with opened(self.registered.device(part)) as camera:
            for _ in range(_READS):
                images.append(self._next(camera).pixels)
                before.append(images[-1].copy())
        found = ""
        if any(np.shares_memory(a, b) for a, b in combinations(images, 2)):
            found = "two images share one buffer"
        elif not all(np.array_equal(a, b) for a, b in zip(images, before, strict=True)):
            found = "an image's pixels are overwritten when later ones are read"
        if found:
            raise Fault(
                part,
                found,
                why="a frame that waits in a queue, or a reference, would turn into a later one",
                do="copy what the driver hands out before it is returned",
            )

    @check(Registered.cameras)
    def test_reading_closed(self, part: Part) -> None:
        """A camera that is closed says so, before it was opened and after."""
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
                    why="a program that handles DeviceError ends with something else",
                    do="do not override read(); it guards _read()",
                ) from error
            else:
                raise Fault(
                    part,
                    f"reading {when} gives something",
                    why="whoever forgot to open it measures what nobody took",
                    do="do not override read(); it guards _read()",
                )
            opened(camera).close()

    @check(Registered.cameras)
    def test_arming(self, part: Part) -> None:
        """An open camera is armed for its profile's exposures and says who switches the lights."""
        camera = self.registered.device(part)
        assert isinstance(camera, Camera)
        with opened(camera):
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
                    why="acquisition must know who goes from one exposure to the next, and two "
                    "cameras of a kind are told apart by device_id",
                    do="return Trigger.SOFTWARE or Trigger.CAMERA from _arm, and words from "
                    "device_id, or leave both out",
                )

    @check(Registered.cameras)
    def test_time_limit(self, part: Part) -> None:
        """A read ends within timeout_s; CameraTimeout is what it says then, and None is the end.

        A camera that :meth:`stall` can stall is measured while it delivers nothing; any other is
        asked for images faster than it can have them.
        """
        with opened(self.registered.device(part)) as camera:
            stalled = self.stall(camera)
            asked_s = _STALLED_S if stalled else _AT_ONCE_S
            for _ in range(1 if stalled else _READS):
                self._judge_read(part, camera, asked_s, stalled)

    def _judge_read(self, part: Part, camera: Camera, asked_s: float, stalled: bool) -> None:
        outcome = within(asked_s + 2 * SLACK_S, lambda: camera.read(asked_s))
        found = ""
        if not outcome.ended or outcome.took_s > asked_s + SLACK_S:
            waited = "it ended" if outcome.ended else "somebody lost patience"
            found = f"read(timeout_s={asked_s}) took {outcome.took_s:.2f} s until {waited}"
        elif outcome.error is not None and not isinstance(outcome.error, CameraTimeout):
            found = (
                f"read(timeout_s={asked_s}) raises {type(outcome.error).__name__} "
                f"({outcome.error}) where it must raise CameraTimeout"
            )
        elif outcome.error is None and stalled:
            given = type(outcome.value).__name__
            found = f"a stalled camera returns {given} where it must raise CameraTimeout"
        elif outcome.error is None and outcome.value is None and camera.read(_PATIENCE_S):
            found = "it returns None and goes on with images; None is the end of a recording"
        if found:
            raise Fault(
                part,
                found,
                why="a program that waits for a lost camera hangs, or ends as if all were read",
                do="wait in _read for timeout_s at the most, then raise "
                "tactile_core.errors.CameraTimeout",
            ) from outcome.error

    def _read(self, part: Part, count: int, *, judged: bool = False) -> list[Image]:
        with opened(self.registered.device(part)) as camera:
            try:
                return [self._next(camera) for _ in range(count)]
            except Unjudged as unjudged:
                if not judged or unjudged.__cause__ is None:
                    raise
                error = unjudged.__cause__
                raise Fault(
                    part,
                    f"reading fails ({type(error).__name__}: {error})",
                    why="there is nothing to measure",
                    do="where no hardware is attached, give options for an emulator",
                ) from error

    def _next(self, camera: Camera) -> Image:
        try:
            image = camera.read(_PATIENCE_S)
            if not isinstance(image, Image | None):
                raise TypeError(f"read() returns {type(image).__name__} instead of an Image")
        except Exception as error:
            raise Unjudged(f"see the check 'image': {error}") from error
        if image is None:
            raise Unjudged("the recording ended too soon; give a longer one in options, or a loop")
        return image


def _what_is_wrong_with(image: Image, first: Image) -> str:
    wrong = image_fault(image)
    if wrong:
        return f"it {wrong}"
    pixels = image.pixels
    if pixels.shape != first.pixels.shape:
        return f"its images change size, from {first.pixels.shape} to {pixels.shape}"
    if pixels.flags.writeable:
        return "its pixels are writable"
    return ""
