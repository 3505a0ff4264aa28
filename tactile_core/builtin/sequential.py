"""``core.sequential`` and ``core.replay``: sequential lights, and images of a recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Self

from pydantic import BaseModel, Field, PositiveFloat, PositiveInt, model_validator

from tactile_core.errors import InputError
from tactile_core.formats.video import NOMINAL_FPS
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import (
    Color,
    Exposure,
    Illumination,
    Light,
    LightOptions,
    refuse_same_names,
)
from tactile_core.quantities import Image
from tactile_core.recordings.recording import Recording, open_recording

if TYPE_CHECKING:
    from tactile_core.interfaces.component import SensorBuild


FEWEST_LIGHTS = 3  # The normal and the albedo have three unknowns (Woodham 1980)


class SequentialLight(LightOptions):
    """A light, and how it is exposed."""

    level: float = Field(default=1.0, gt=0, le=1, description="Brightness; 1 is full.")
    exposure_time_s: PositiveFloat | None = Field(
        default=None,
        description="Exposure time of this light, s, if the camera can change it between images. "
        "Default: that of the camera.",
    )
    color: Color | None = Field(
        default=None,
        description="Colour of the image that measures a coloured light, with image.color: rgb; "
        "the others hold little of it, and noise. Default: the whole image, which is grey.",
    )


class SequentialOptions(Options):
    """Options of ``core.sequential``."""

    lights: tuple[SequentialLight, ...] = Field(
        min_length=FEWEST_LIGHTS, description="The lights in the order in which they fire."
    )

    dark: bool = Field(
        default=False,
        description="Take one more exposure without light and subtract it from the others.",
    )

    @model_validator(mode="after")
    def _lights_differ(self) -> Self:
        refuse_same_names(self.lights)
        return self

    @model_validator(mode="after")
    def _all_coloured_or_none(self) -> Self:
        if len({light.color is None for light in self.lights}) > 1:
            raise ValueError("some lights have a color; give every light one, or none")
        return self


class SequentialIllumination(Illumination):
    """Fires one light per exposure, whose channel has the name of the light.

    With ``dark``, a last exposure without any light measures the ambient light.

    References
    ----------
    .. [1] R. J. Woodham, "Photometric method for determining surface orientation from multiple
       images", Optical Engineering 19(1), 1980.
    """

    Options: ClassVar[type[BaseModel]] = SequentialOptions

    def __init__(self, options: SequentialOptions) -> None:
        super().__init__(options)
        self._lights = tuple(light.make_light() for light in options.lights)
        self._exposed = options.lights
        self._dark = options.dark

    @property
    def lights(self) -> tuple[Light, ...]:
        """The lights, in the order in which they fire."""
        return self._lights

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the lights."""
        return tuple(light.name for light in self._lights)

    def exposures(self) -> tuple[Exposure, ...]:
        """One exposure per light, and a dark one at the end if requested."""
        lit = tuple(
            Exposure(
                {light.name: light.level},
                (light.name,),
                light.exposure_time_s,
                color=light.color,
            )
            for light in self._exposed
        )
        return (*lit, Exposure({}, ())) if self._dark else lit


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
