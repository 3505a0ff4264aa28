"""``core.virtual``: the camera of a profile's virtual sensor."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field

from tactile_core.formats.video import NOMINAL_FPS
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.illumination import Exposure
from tactile_core.quantities import Image
from tactile_core.sim.script import Script
from tactile_core.sim.stage import VirtualStage
from tactile_core.sim.unit_options import UnitOptions

_TOUCH = Path(__file__).with_name("touch.yaml")


class VirtualOptions(UnitOptions):
    """Options of the virtual camera."""

    script: Path | None = Field(
        default=None,
        description="YAML script as for 'tactile simulate'. Default: a ball presses and leaves.",
    )
    loop: bool = Field(default=False, description="Restart the script when it ends.")


class VirtualCamera(Camera):
    """Plays a script on a virtual stage and delivers its images, then None.

    Each read returns the next exposure of the rig's sequence, so lights and camera stay
    synchronised as long as every exposure is read. Timestamps are simulated: the same script gives
    the same readings on any machine. A step without seconds takes one frame at the nominal rate.

    Parameters
    ----------
    options : VirtualOptions
    profile : SensorBuild
        The sensor to simulate.
    """

    Options: ClassVar[type[BaseModel]] = VirtualOptions
    live: ClassVar[bool] = False

    def __init__(self, options: VirtualOptions, profile: SensorBuild) -> None:
        super().__init__(options)
        self._settings, self._profile = options, profile
        self._images: Iterator[Image] = iter(())

    @classmethod
    def of(cls, options: BaseModel, build: SensorBuild) -> Self:
        """Make the camera of a profile's virtual sensor."""
        assert isinstance(options, VirtualOptions)
        return cls(options, build)

    def _open(self) -> None:
        stage = VirtualStage(self._profile, self._settings.seed, self._settings.mode)
        script = Script(self._settings.script or _TOUCH)
        self._images = _played_images(stage, script, loop=self._settings.loop)

    def _close(self) -> None:
        self._images = iter(())

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        # the stage steps through the exposure sequence itself
        return Trigger.CAMERA

    def _read(self, timeout_s: float) -> Image | None:
        return next(self._images, None)


def _played_images(stage: VirtualStage, script: Script, *, loop: bool) -> Iterator[Image]:
    shot, time_s = 0, 0.0
    while True:
        staged_s = 0.0
        for number, _ in enumerate(script.played(stage)):
            if shot:
                elapsed_s = stage.time_s - staged_s
                time_s += elapsed_s if elapsed_s > 0 else 1 / NOMINAL_FPS
            staged_s = stage.time_s
            for index, pixels in enumerate(stage.exposures()):
                shown = pixels[..., 0] if pixels.shape[2] == 1 else pixels
                yield Image(
                    np.ascontiguousarray(shown),
                    timestamp_s=time_s,
                    sequence=shot,
                    source=f"{number:06d}",
                    exposure_index=index,
                )
                shot += 1
        if not loop:
            return
        stage.reset()
