"""``core.replay``: a recording in place of a camera."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Self

from pydantic import BaseModel, Field, PositiveFloat, PositiveInt

from tactile_core.errors import InputError
from tactile_core.formats.video import NOMINAL_FPS
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure
from tactile_core.quantities import Image
from tactile_core.recordings.recording import Recording, open_recording

if TYPE_CHECKING:
    from tactile_core.interfaces.component import SensorBuild


class ReplayOptions(Options):
    """Options of ``core.replay``."""

    path: Path | None = Field(
        default=None, description="An image, a folder of images, a video or a scan."
    )
    images_per_observation: PositiveInt = Field(
        default=1,
        description="Exposures per frame, for rigs whose lights fire one after another.",
    )
    fps: PositiveFloat | None = Field(
        default=None,
        description="Images a second of files without times of their own. Default: 30.",
    )
    loop: bool = Field(default=False, description="Start again at the end.")


class ReplayCamera(Camera):
    """Delivers the exposures of a recording as fast as they are requested, then None.

    ``Image.source`` is the name of the observation. Timestamps are those of the recording, and
    continue when it loops.
    """

    Options: ClassVar[type[BaseModel]] = ReplayOptions
    live: ClassVar[bool] = False

    def __init__(self, options: ReplayOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._images: Iterator[Image] = iter(())
        self._has_lights = False

    @classmethod
    def for_build(cls, options: BaseModel, build: SensorBuild) -> Self:
        """Make the camera of a sensor build."""
        made = super().for_build(options, build)
        made._has_lights = build.illumination.driver is not None
        return made

    def _open(self) -> None:
        if self._settings.path is None:
            if self._has_lights:
                raise InputError(
                    "the profile has a light driver, but core.replay is no camera that its lights "
                    "could be switched for; name the camera in 'camera', or give a recording with "
                    "--input"
                )
            raise InputError(
                "core.replay has nothing to play; give a recording with --input, or name the "
                "sensor's camera in 'camera' of the profile"
            )
        recording = open_recording(
            self._settings.path, images_per_observation=self._settings.images_per_observation
        )
        self._images = _play_images(recording.with_rate(self._settings.fps), self._settings.loop)

    def _close(self) -> None:
        self._images = iter(())

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        # the lights were switched during the recording
        return Trigger.CAMERA

    def _read(self, timeout_s: float) -> Image | None:
        return next(self._images, None)


def _play_images(recording: Recording, loop: bool) -> Iterator[Image]:
    sequence, added_s, last_s, step_s = 0, 0.0, float("nan"), 1 / NOMINAL_FPS
    while True:
        begins = bool(sequence)
        for observation in recording:
            for index, image in enumerate(observation.images):
                if begins:
                    begins, added_s = False, last_s + step_s - image.timestamp_s
                time_s = image.timestamp_s + added_s
                step_s, last_s = time_s - last_s if sequence else step_s, time_s
                yield replace(image, sequence=sequence, timestamp_s=last_s, exposure_index=index)
                sequence += 1
        if not loop:
            return
