"""Acquires frames: switches the lights, reads an image per exposure, and assembles the frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tactile_core.acquisition.assembly import Assembly
from tactile_core.acquisition.devices import CAMERA, DRIVER
from tactile_core.acquisition.free_running import HOST, Clock, FreeRunning
from tactile_core.errors import CameraLost, DeviceError, InputError
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.illumination import Exposure, Illumination
from tactile_core.interfaces.image import ImageSection
from tactile_core.plugins.blame import blame, fault
from tactile_core.plugins.registry import origin_of
from tactile_core.quantities import Frame, Image, Reference
from tactile_core.quantities.array_form import image_fault, size_change

if TYPE_CHECKING:
    from tactile_core.interfaces.light_driver import LightDriver


class Settings(NamedTuple):
    """Settings of the camera during one exposure; None where it does not report them.

    Attributes
    ----------
    exposure_time_s, gain : float or None
        The gain is in the camera's own units.
    """

    exposure_time_s: float | None
    gain: float | None


class Acquisition:
    """Runs the illumination's exposure sequence and yields one :class:`Frame` per observation.

    Parameters
    ----------
    camera : Camera
    illumination : Illumination
    image : ImageSection
    driver : LightDriver, optional
        Switches the lights; not needed for a recording or a virtual sensor.
    keep_raw : bool
        Whether a frame keeps the images as the camera sent them, in ``frame.raw``.
    clock : Clock
        That of the camera's timestamps.

    Attributes
    ----------
    exposures : tuple of Exposure
        Those of one observation, in order.
    images : tuple of Image
        Those of the latest observation, in the order of its exposures.
    settings : tuple of Settings
        Exposure time and gain of each exposure of the latest observation, as read back.
    keep_raw : bool
        May be changed at any time.
    triggers : bool
        Whether each exposure is triggered, so that nothing arrives that nobody reads.
    """

    def __init__(
        self,
        camera: Camera,
        illumination: Illumination,
        image: ImageSection,
        driver: LightDriver | None = None,
        *,
        keep_raw: bool = False,
        clock: Clock = HOST,
    ) -> None:
        self._camera = camera
        self._driver = driver
        self._assembly = Assembly(illumination, image)
        self.keep_raw = keep_raw
        self.exposures = self._assembly.exposures
        self._own_settings = any(
            one.exposure_time_s is not None or one.gain is not None for one in self.exposures
        )
        self._clock = clock
        self._settled_s = float("-inf")
        self._stream: FreeRunning | None = None
        self._trigger: Trigger | None = None
        self.triggers = False
        self._shining: Mapping[str, float] | None = None
        self._sequence = 0
        self.settings: tuple[Settings, ...] = ()
        self._size_px: tuple[int, int] | None = None
        self.images: tuple[Image, ...] = ()

    def restart(self) -> None:
        """Number the observations from 0 again, for a recording that is played once more."""
        self._sequence = 0

    def arm(self) -> None:
        """Prepare the open camera for the sequence.

        Otherwise the first observation does it, and each observation after a failed one.

        Raises
        ------
        DeviceError
            The camera cannot take these exposures.
        InputError
            The lights are sequential, but nothing switches them.
        """
        self._shining = None
        with blame(CAMERA, self._camera):
            self._trigger = self._camera.arm(self.exposures)
        if not isinstance(self._trigger, Trigger):
            given = type(self._trigger).__name__
            raise fault(CAMERA, self._camera, f"returned {given} from arm() instead of a Trigger")
        if self._trigger is not Trigger.CAMERA and self._driver is None and len(self.exposures) > 1:
            raise InputError(
                f"one observation takes {len(self.exposures)} exposures under different lights, "
                f"but {origin_of(self._camera)} does not switch them; name a light driver in "
                f"the profile, as 'illumination: {{driver: {{use: …}}}}'"
            )
        self.triggers = self._trigger is Trigger.SOFTWARE
        if self._trigger is Trigger.FREE_RUNNING and self._stream is None:
            self._stream = self._begin_stream()

    @property
    def stamp_delay_s(self) -> float | None:
        """Delay of the timestamps of a free-running camera, s; None if it is unknown."""
        return None if self._stream is None else self._stream.stamp_delay_s

    def widen_margin(self) -> None:
        """Wait longer after each change of light, since an image has shown the wrong one.

        Applies to a free-running camera whose timestamps are not what they seemed.
        """
        if self._stream is not None:
            self._stream.stamp_delay_s = None

    def observe(self, timeout_s: float = 1.0) -> Frame | None:
        """Acquire one observation; return None at the end of a recording.

        Blocks for at most ``timeout_s`` per exposure.

        Raises
        ------
        DeviceError
            The camera or the lights failed, a recording ended within a sequence, or the images
            carry the wrong exposure indices.
        InputError
            An image does not match the profile.
        """
        if self._trigger is None:
            self.arm()
        try:
            images = self._in_order(self._take_images(timeout_s))
        except BaseException:
            self._trigger = None  # the next observation starts again at the first exposure
            raise
        if not images:
            return None
        frame = self._assembly.frame(images, self._sequence)
        self.settings = tuple(Settings(one.exposure_time_s, one.gain) for one in images)
        self.images = tuple(images)
        self._sequence += 1
        return replace(frame, raw=self.images) if self.keep_raw else frame

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.observe()) is not None:
            yield frame

    def _take_images(self, timeout_s: float) -> list[Image]:
        """Return the images of one observation as they arrive; none at a recording's end."""
        images: list[Image] = []
        following = (*self.exposures[1:], self.exposures[0])
        for exposure, then in zip(self.exposures, following, strict=True):
            self._light(exposure)
            image = self._take_exposure(exposure, then, timeout_s)
            if image is None:
                if images:
                    raise CameraLost("the recording ended in the middle of a sequence of lights")
                break
            images.append(image)
        return images

    def _in_order(self, images: Sequence[Image]) -> list[Image]:
        """Sort the images of one observation by exposure, if they carry an exposure index.

        A camera that runs the sequence itself can start anywhere in it.
        """
        placed: dict[int, Image] = {}
        for came, image in enumerate(images):
            index = came if image.exposure_index is None else image.exposure_index
            if index not in range(len(images)):
                raise fault(
                    CAMERA,
                    self._camera,
                    f"returned an image whose exposure_index is {index!r}; one observation has "
                    f"{len(images)}",
                )
            if index != came and self._trigger is not Trigger.CAMERA:
                raise DeviceError(
                    f"the lights of exposure {came} were on, but the camera returned an image of "
                    f"exposure {index}; it must wait for a new image, or trigger the lights itself"
                )
            if index in placed:
                raise DeviceError(
                    f"exposure {index} arrived twice in one observation and another one is "
                    f"missing: an image was lost between camera and computer; read again"
                )
            placed[index] = image
        return [placed[index] for index in range(len(images))]

    def _light(self, exposure: Exposure) -> None:
        """Switch to the lights of an exposure, unless they are on or the camera does it."""
        if self._driver is None or self._trigger is Trigger.CAMERA:
            return
        if exposure.levels != self._shining:
            self._switch(exposure.levels)
            return
        with blame(DRIVER, self._driver):
            self._driver.check()

    def _switch(self, levels: Mapping[str, float]) -> None:
        assert self._driver is not None
        self._shining = None
        with blame(DRIVER, self._driver):
            self._driver.set(levels)
        self._settled_s = self._clock.now()
        self._shining = levels

    def _take_exposure(self, exposure: Exposure, then: Exposure, timeout_s: float) -> Image | None:
        """Return the image of an exposure; if possible, switch the lights for the next one."""
        if self._own_settings:
            with blame(CAMERA, self._camera):
                self._camera.prepare(exposure)
        if self._stream is not None and self._trigger is Trigger.FREE_RUNNING:
            return self._stream.first_after(self._settled_s, exposure, timeout_s)
        if self._trigger is Trigger.SOFTWARE:
            with blame(CAMERA, self._camera):
                ended = self._camera.expose(timeout_s)
            if ended:
                self._light(then)
        return self._image(timeout_s)

    def _image(self, timeout_s: float) -> Image | None:
        with blame(CAMERA, self._camera):
            image = self._camera.read(timeout_s)
        wrong = "" if image is None else image_fault(image)
        if wrong:
            raise fault(CAMERA, self._camera, wrong)
        if image is not None:
            size = image.pixels.shape[1], image.pixels.shape[0]
            # kept when the camera is opened again, because the reference has this size, too
            self._size_px = self._size_px or size
            if size != self._size_px:
                raise DeviceError(size_change(self._size_px, size))
        return image

    def _begin_stream(self) -> FreeRunning:
        """Measure the timing of a free-running camera, as far as the sequence depends on it."""
        with blame(CAMERA, self._camera):
            known = self._camera.stamp_delay_s
        stream = FreeRunning(self._image, self._clock, known)
        if self._driver is not None:
            stream.measure_period()
            if known is None and len(self.exposures) > 1:
                stream.measure_delay(self._switch, self.exposures[0].levels)
        return stream


def average(frames: list[Frame]) -> Reference:
    """Average frames of the undeformed sensor into a reference.

    Raises
    ------
    InputError
        There is no frame, or the frames differ in size.
    """
    if not frames:
        raise InputError("no frame for the reference; give at least one of the undeformed sensor")
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
