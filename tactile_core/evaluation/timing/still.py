"""A camera that has its images already."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import Options
from tactile_core.quantities import Image, Pixels


class StillCamera(Camera):
    """Sends the same exposures again and again, without a wait."""

    def __init__(self, exposures: Sequence[Pixels]) -> None:
        super().__init__(Options())
        self._exposures = cycle(exposures)

    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        """Nothing to release."""

    def _read(self, timeout_s: float) -> Image:
        return Image(next(self._exposures))
