"""``sim.virtual`` and ``sim.hand``: cameras that look through a virtual gel."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Mapping
from pathlib import Path
from threading import Lock
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field

from tactile_core.errors import InputError
from tactile_core.formats.video import NOMINAL_FPS
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.simulator import Aim, Hand, HandCamera
from tactile_core.quantities import Image
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.script import Script
from tactile_sim.stage import UnitOptions, VirtualStage
from tactile_sim.truth import TrueState

_LOWERING_MM_S = 1.5  # Fastest motion up and down: calm motions of a person


class CalmHand(Hand):
    """Moves an object towards its aim, as calmly as a person does.

    Parameters
    ----------
    surface : GelSurface
    """

    def __init__(self, surface: GelSurface) -> None:
        self._surface = surface
        self._lock = Lock()
        self._goal = self._at = Aim()
        self._object: tuple[str, dict[str, Any]] = ("sphere", {"diameter_mm": 5.0})
        self._taken = self._object
        self.problem = ""

    @property
    def deepest_mm(self) -> float:
        """Deepest press: a third of the gel."""
        # the layer of elastomer is linear up to about a third
        return 0.35 * self._surface.gel.elastomer.thickness_mm

    def take(self, kind: str, options: Mapping[str, Any]) -> None:
        """Choose the object; one that is pressed is released first.

        Raises
        ------
        InputError
            There is no such object.
        """
        make_indenter(kind, **options)
        with self._lock:
            self._object = (kind, dict(options))

    def aim(self, goal: Aim) -> None:
        """Choose where the object should be; the motion takes its time."""
        with self._lock:
            self._goal, self.problem = goal, ""

    def step(self, seconds: float) -> None:
        """Let time pass, and move towards the aim."""
        seconds = min(seconds, 0.1)  # a slower computer moves the object more slowly
        with self._lock:
            goal, wanted = self._goal, self._object
        surface = self._surface
        try:
            if surface.pressed and (not goal.pressed or wanted != self._taken):
                surface.release(seconds)
            elif surface.pressed:
                self._move(goal, seconds)
            elif goal.pressed:
                self._press(goal, wanted, seconds)
            else:
                surface.hold(seconds)
        except InputError as error:  # for example beyond the border of the gel
            with self._lock:
                self._goal, self.problem = Aim(), str(error)

    def _press(self, goal: Aim, wanted: tuple[str, dict[str, Any]], seconds: float) -> None:
        kind, options = self._taken = wanted
        place = {"x_mm": goal.x_mm, "y_mm": goal.y_mm, "angle_deg": goal.angle_deg}
        self._surface.indent_with(make_indenter(kind, **options), **place)
        depth_mm = min(goal.depth_mm, self.deepest_mm, _LOWERING_MM_S * seconds)
        self._surface.press(depth_mm=max(depth_mm, 1e-3), steps=1, seconds=seconds)
        self._at = Aim(**place, depth_mm=depth_mm, pressed=True)

    def _move(self, goal: Aim, seconds: float) -> None:
        at, far = self._at, 6.0 * seconds  # mm/s along the surface
        low, turn = _LOWERING_MM_S * seconds, 60.0 * seconds
        dx, dy = goal.x_mm - at.x_mm, goal.y_mm - at.y_mm
        share = min(1.0, far / max((dx**2 + dy**2) ** 0.5, 1e-12))
        dx, dy = share * dx, share * dy
        degrees = _clamp_value(goal.angle_deg - at.angle_deg, turn)
        depth_mm = at.depth_mm + _clamp_value(
            min(goal.depth_mm, self.deepest_mm) - at.depth_mm, low
        )
        self._surface.move(dx, dy, degrees, depth_mm=max(depth_mm, 0.0), seconds=seconds)
        self._at = Aim(at.x_mm + dx, at.y_mm + dy, at.angle_deg + degrees, depth_mm, True)


def _clamp_value(value: float, most: float) -> float:
    return min(max(value, -most), most)


_TOUCH = Path(__file__).with_name("touch.yaml")


class VirtualOptions(UnitOptions):
    """Options of the virtual camera."""

    script: Path | None = Field(
        default=None,
        description="YAML script as for 'tactile simulate'. Default: a ball presses and leaves.",
    )
    loop: bool = Field(default=False, description="Restart the script when it ends.")


class StageCamera(Camera):
    """Looks at a virtual stage, which steps through the exposure sequence itself.

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

    @classmethod
    def for_build(cls, options: BaseModel, build: SensorBuild) -> Self:
        """Make the camera of a profile's virtual sensor."""
        assert isinstance(options, UnitOptions)
        return cls(options, build)

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        return Trigger.CAMERA


class VirtualCamera(StageCamera):
    """Plays a script on a virtual stage and delivers its images, then None.

    Each read returns the next exposure of the rig's sequence, so lights and camera stay
    synchronised as long as every exposure is read. Timestamps are simulated: the same script gives
    the same readings on any machine. A step without seconds takes one frame at the nominal rate.
    """

    Options: ClassVar[type[BaseModel]] = VirtualOptions
    _images: Iterator[Image] = iter(())

    def _open(self) -> None:
        stage = VirtualStage(self._profile, self._settings.seed, self._settings.mode)
        assert isinstance(self._settings, VirtualOptions)
        script = Script(self._settings.script or _TOUCH)
        self._images = _played_images(stage, script, loop=self._settings.loop)

    def _close(self) -> None:
        self._images = iter(())

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


class VirtualHandCamera(StageCamera, HandCamera):
    """Shows a virtual sensor in real time, as far as the computer is fast enough.

    Each observation lets the time pass that has passed since the one before. Timestamps are those
    of the host's clock.
    """

    def __init__(self, options: UnitOptions, profile: SensorBuild) -> None:
        super().__init__(options, profile)
        self._stage: VirtualStage | None = None
        self._hand: CalmHand | None = None
        self._left: deque[Image] = deque()
        self._stepped_s = 0.0
        self._shot = 0
        self.truth: TrueState | None = None

    @property
    def hand(self) -> CalmHand:
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
        self._hand = CalmHand(self._stage)
        self._left.clear()
        self._stepped_s = time.monotonic()

    def _close(self) -> None:
        self._stage = self._hand = self.truth = None
        self._left.clear()

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
