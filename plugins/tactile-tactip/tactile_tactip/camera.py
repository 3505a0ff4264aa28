"""``tactip.virtual``: a camera inside a virtual dome that a plate presses."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field

from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.device import Options
from tactile_core.quantities import Image
from tactile_tactip.dome import Plate, picture, pressed_pins

_FRAMES = 60
_FPS = 30.0


class VirtualOptions(Options):
    """Options of the virtual camera."""

    seed: int = Field(default=0, ge=0, description="Selects the unit: its light and its noise.")


class VirtualTacTip(Camera):
    """Shows the undeformed dome, then a plate that presses, shears and leaves; then None.

    Timestamps are simulated, so that the same seed gives the same readings on any machine.
    """

    Options: ClassVar[type[BaseModel]] = VirtualOptions
    live: ClassVar[bool] = False

    def __init__(self, options: VirtualOptions, build: SensorBuild) -> None:
        super().__init__(options)
        self._seed, self._image = options.seed, build.image
        self._sequence = 0

    @classmethod
    def for_build(cls, options: BaseModel, build: SensorBuild) -> Self:
        """Make the camera of a profile's virtual sensor."""
        assert isinstance(options, VirtualOptions)
        return cls(options, build)

    def _open(self) -> None:
        self._sequence = 0

    def _close(self) -> None:
        pass

    def _read(self, timeout_s: float) -> Image | None:
        number = self._sequence
        if number >= _FRAMES:
            return None
        self._sequence += 1
        pins_mm = pressed_pins(plate_at(number / (_FRAMES - 1)))
        pixels = picture(pins_mm, self._image, number=number, seed=self._seed)
        return Image(pixels, timestamp_s=number / _FPS, sequence=number, source=f"{number:06d}")


def plate_at(part: float) -> Plate:
    """Return the plate at a part 0..1 of its motion."""
    press = float(np.sin(np.pi * part) ** 2)
    return Plate(depth_mm=-3.0 + 6.0 * press, angle_deg=10.0 * press, shear_mm=(press * part, 0.0))
