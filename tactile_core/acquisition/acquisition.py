"""From exposures to frames: light, expose, straighten, pair each image with its light."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.algorithms.intensity import CEILING
from tactile_core.errors import CameraLost, InputError
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.illumination import Exposure, Illumination
from tactile_core.interfaces.image import ImageSection
from tactile_core.plugins.blame import blame, fault
from tactile_core.quantities import Frame, Image, Pixels, Reference
from tactile_core.quantities.array_form import image_fault

CAMERA, LIGHTS = "the camera", "the lights"
"""How messages name the parts of a sensor."""


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
        self._image = image
        self._geometry = ImageGeometry(image)
        self._keep_raw = keep_raw
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
        planes: list[Pixels] = []
        times: list[float] = []
        dark: Pixels | None = None
        exposures = exposures_of(self._illumination)
        for exposure in exposures:
            with blame(LIGHTS, self._illumination):
                self._illumination.set(exposure.levels)
            image = self._exposed(timeout_s)
            if image is None:
                if images:
                    raise CameraLost("the recording ended in the middle of a sequence of lights")
                return None
            images.append(image)
            if exposure.channels:
                planes.append(self._planes(image, len(exposure.channels)))
                times.append(image.timestamp_s)
            else:
                dark = self._planes(image, planes[0].shape[2] if planes else 1)
        if dark is not None:
            planes = [_less(plane, dark, self._image.full_scale) for plane in planes]
        return self._frame(images, planes, tuple(times))

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

    def _planes(self, image: Image, wanted: int) -> Pixels:
        try:
            pixels = self._geometry.apply(image.pixels)
        except InputError as error:
            raise InputError(f"{image.source or 'camera'}: {error}") from error
        pixels = pixels if pixels.ndim == 3 else pixels[..., None]
        if pixels.shape[2] != wanted:
            raise InputError(
                f"{image.source or 'camera'}: the image has {pixels.shape[2]} channels where the "
                f"light gives {wanted}; set 'image.color' and 'illumination' in the profile"
            )
        return pixels

    def _frame(self, images: list[Image], planes: list[Pixels], times: tuple[float, ...]) -> Frame:
        frame = Frame(
            pixels=planes[0] if len(planes) == 1 else _channels_of(planes),
            channels=self._illumination.channels,
            mm_per_px=self._image.mm_per_px,
            full_scale=self._image.full_scale,
            timestamp_s=sum(times) / len(times),
            wall_time_s=sum(image.wall_time_s for image in images) / len(images),
            sequence=self._sequence,
            source=images[0].source,
            exposure_times_s=times,
            raw=tuple(images) if self._keep_raw else (),
        )
        self._sequence += 1
        return frame


def _channels_of(planes: list[Pixels]) -> Pixels:
    """(H, W, K) of K exposures, stored one after another, as photometric stereo reads them."""
    return np.concatenate([plane.transpose(2, 0, 1) for plane in planes]).transpose(1, 2, 0)


def _less(lit: Pixels, dark: Pixels, full_scale: float) -> Pixels:
    """Subtract the light that none of the lights gives.

    Never below 0, where unsigned pixels would wrap. Saturated pixels stay as they are: what they
    really amount to is unknown, and less than the ceiling would pass for a measurement.
    """
    return np.where(lit >= CEILING * full_scale, lit, lit - np.minimum(lit, dark))


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


def exposures_of(lights: Illumination) -> tuple[Exposure, ...]:
    """Return the exposures of one observation.

    Raises
    ------
    PluginFault
        They are something else, or do not measure each of the lights' channels.
    """
    with blame(LIGHTS, lights):
        exposures, channels = tuple(lights.exposures()), tuple(lights.channels)
        measured = sum(len(exposure.channels) for exposure in exposures)
    if not measured == len(channels) > 0:
        raise fault(LIGHTS, lights, f"have {len(channels)} channels and exposures for {measured}")
    return exposures
