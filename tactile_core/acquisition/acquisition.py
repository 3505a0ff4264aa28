"""From exposures to frames: light, expose, straighten, pair each image with its light."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.acquisition.assembly import LIGHTS, Assembly, exposures_of
from tactile_core.errors import CameraLost, InputError
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.illumination import Illumination
from tactile_core.interfaces.image import ImageSection
from tactile_core.plugins.blame import blame, fault
from tactile_core.quantities import Frame, Image, Reference
from tactile_core.quantities.array_form import image_fault

CAMERA = "the camera"
"""How messages name it."""


class Acquisition:
    """Carries out the illumination's sequence with the camera, one :class:`Frame` at a time."""

    def __init__(
        self,
        camera: Camera,
        illumination: Illumination,
        image: ImageSection,
        *,
        keep_raw: bool = False,
    ) -> None:
        self._camera = camera
        self._illumination = illumination
        self._assembly = Assembly(illumination, image, keep_raw=keep_raw)
        self._sequence = 0

    def observe(self, timeout_s: float = 1.0) -> Frame | None:
        """Take one observation; None when a recording has come to its end.

        Blocks for ``timeout_s`` per exposure at the most.

        Raises
        ------
        DeviceError
            The camera or the lights failed, or a recording ended amid a sequence.
        InputError
            An image is not what the profile describes.
        """
        images: list[Image] = []
        for exposure in exposures_of(self._illumination):
            with blame(LIGHTS, self._illumination):
                self._illumination.set(exposure.levels)
            image = self._exposed(timeout_s)
            if image is None:
                if images:
                    raise CameraLost("the recording ended in the middle of a sequence of lights")
                return None
            images.append(image)
        frame = self._assembly.frame(images, self._sequence)
        self._sequence += 1
        return frame

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.observe()) is not None:
            yield frame

    def _exposed(self, timeout_s: float) -> Image | None:
        with blame(CAMERA, self._camera):
            image = self._camera.read(timeout_s)
        wrong = "" if image is None else image_fault(image)
        if wrong:
            raise fault(CAMERA, self._camera, wrong)
        return image


def average(frames: list[Frame]) -> Reference:
    """Average untouched frames into a reference.

    Raises
    ------
    InputError
        There is no frame, or they differ in size.
    """
    if not frames:
        raise InputError("no frame to take the reference from; give at least one untouched image")
    if len({frame.pixels.shape for frame in frames}) > 1:
        raise InputError("the reference's frames differ in size; give images of one size")
    total = np.zeros(frames[0].pixels.shape, np.float64)
    squares = np.zeros_like(total)
    for frame in frames:
        total += frame.pixels
        squares += np.square(frame.pixels, dtype=np.float64)
    n = len(frames)
    mean = total / n
    spread = (squares - n * mean**2) / (n - 1) if n > 1 else np.zeros_like(total)
    return Reference(
        pixels=mean.astype(np.float32),
        channels=frames[0].channels,
        full_scale=frames[0].full_scale,
        noise=float(np.sqrt(np.median(np.maximum(spread, 0)))),
        frames=n,
    )
