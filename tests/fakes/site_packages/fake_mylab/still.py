"""A camera that shows one grey picture for ever."""

from __future__ import annotations

import numpy as np

from tactile_core.interfaces.camera import Camera
from tactile_core.quantities import Image


class StillCamera(Camera):
    def _open(self) -> None:
        self._pixels = np.full((6, 8), 128, np.uint8)

    def _close(self) -> None:
        del self._pixels

    def _read(self, timeout_s: float) -> Image:
        return Image(self._pixels)
