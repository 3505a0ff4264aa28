"""``core.virtual`` and ``core.virtual_hand``: cameras that look through a virtual gel."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field

from tactile_core.errors import InputError
from tactile_core.formats.video import NOMINAL_FPS
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.illumination import Exposure
from tactile_core.quantities import Image
from tactile_core.sim.hand import Hand
from tactile_core.sim.script import Script
from tactile_core.sim.stage import VirtualStage
from tactile_core.sim.truth import TrueState
from tactile_core.sim.unit import UnitOptions

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
    def for_build(cls, options: BaseModel, build: SensorBuild) -> Self:
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
        for number, _ in enumerate(script.play_frames(stage)):
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


class HandCamera(Camera):
    """Shows a virtual sensor in real time, as far as the computer is fast enough.

    Each observation lets the time pass that has passed since the one before. Timestamps are those
    of the host's clock.

    Parameters
    ----------
    options : UnitOptions
    profile : SensorBuild
        The sensor to simulate.
    """

    Options: ClassVar[type[BaseModel]] = UnitOptions
    live: ClassVar[bool] = False

    def __init__(self, options: UnitOptions, profile: SensorBuild) -> None:
        super().__init__(options)
        self._settings, self._profile = options, profile
        self._stage: VirtualStage | None = None
        self._hand: Hand | None = None
        self._left: deque[Image] = deque()
        self._stepped_s = 0.0
        self._shot = 0
        self.truth: TrueState | None = None

    @classmethod
    def for_build(cls, options: BaseModel, build: SensorBuild) -> Self:
        """Make the camera of a profile's virtual sensor."""
        assert isinstance(options, UnitOptions)
        return cls(options, build)

    @property
    def hand(self) -> Hand:
        """The hand that moves the object.

        Raises
        ------
        InputError
            The camera is closed.
        """
        if self._hand is None:
            raise InputError("the virtual camera is closed; open it before moving an object")
        return self._hand

    def _open(self) -> None:
        self._stage = VirtualStage(self._profile, self._settings.seed, self._settings.mode)
        self._hand = Hand(self._stage)
        self._left.clear()
        self._stepped_s = time.monotonic()

    def _close(self) -> None:
        self._stage = self._hand = self.truth = None
        self._left.clear()

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        # the stage steps through the exposure sequence itself
        return Trigger.CAMERA

    def _read(self, timeout_s: float) -> Image | None:
        if not self._left:
            self._expose_all()
        return self._left.popleft()

    def _expose_all(self) -> None:
        assert self._stage is not None
        early_s = self._stepped_s + 1 / NOMINAL_FPS - time.monotonic()
        if early_s > 0:
            time.sleep(early_s)
        now_s = time.monotonic()
        self.hand.step(now_s - self._stepped_s)
        self._stepped_s = now_s
        for index, pixels in enumerate(self._stage.exposures()):
            shown = pixels[..., 0] if pixels.shape[2] == 1 else pixels
            self._left.append(
                Image(
                    np.ascontiguousarray(shown),
                    timestamp_s=now_s,
                    wall_time_s=time.time(),
                    sequence=self._shot,
                    exposure_index=index,
                )
            )
            self._shot += 1
        self.truth = self._stage.truth()
