"""A camera that repeats given images."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import ClassVar

from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure
from tactile_core.quantities import Image, Pixels


class StillCamera(Camera):
    """Delivers the same exposures repeatedly and without delay."""

    live: ClassVar[bool] = False

    def __init__(self, exposures: Sequence[Pixels]) -> None:
        super().__init__(Options())
        self._exposures = cycle(exposures)

    def _open(self) -> None:
        """Nothing to open."""

    def _close(self) -> None:
        """Nothing to release."""

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        return Trigger.CAMERA

    def _read(self, timeout_s: float) -> Image:
        return Image(next(self._exposures))
