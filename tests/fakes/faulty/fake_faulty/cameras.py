"""A sound camera, and others that each do one thing wrong."""

from __future__ import annotations

import os
import queue
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from tactile_core.errors import CameraTimeout, DeviceError
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.quantities import Image

DRIVER = Path(__file__)
"""Stands for a device file."""


class Ramp(Camera):
    """Shows a ramp that moves; holds a thread and a file while it is open."""

    def __init__(self, options: BaseModel) -> None:
        super().__init__(options)
        self._ended: threading.Event | None = None
        self._reader: threading.Thread | None = None
        self._file: int | None = None
        self.stalled = False

    def _open(self) -> None:
        self._file = os.open(DRIVER, os.O_RDONLY)
        self._ended = threading.Event()
        self._reader = threading.Thread(target=self._ended.wait, name="reader", daemon=True)
        self._reader.start()
        self._sequence = 0

    def _close(self) -> None:
        if self._reader is not None and self._ended is not None:
            self._ended.set()
            self._reader.join()
            self._reader = None
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _read(self, timeout_s: float) -> Image | None:
        if self.stalled or timeout_s < 0.005:
            time.sleep(timeout_s)
            return self._late()
        time.sleep(0.005)
        self._sequence += 1
        return self._image()

    def _late(self) -> Image | None:
        raise CameraTimeout("no image yet")

    def _pixels(self) -> Any:
        return np.full((6, 8), self._sequence % 256, np.uint8)

    def _image(self) -> Image:
        return Image(self._pixels(), time.monotonic(), time.time(), self._sequence)


class Mutable(Ramp):
    class Options(BaseModel):
        model_config = ConfigDict(extra="forbid")


class Unforbidding(Ramp):
    class Options(BaseModel):
        model_config = ConfigDict(frozen=True)


class Undocumented(Ramp):
    class Options(Options):
        fps: float = 30.0


class Nested(Ramp):
    class Options(Options):
        class Lens(BaseModel):
            model_config = ConfigDict(frozen=True)

        lenses: tuple[Lens, ...] = Field(default=(), description="Lenses.")


class Demanding(Ramp):
    class Options(Options):
        port: str = Field(description="Where it is plugged in.")


class Hasty(Ramp):
    def __init__(self, options: BaseModel) -> None:
        super().__init__(options)
        self.lock = os.open(DRIVER, os.O_RDONLY)


class Absent(Ramp):
    def _open(self) -> None:
        raise DeviceError("there is no camera; plug it in")


class OpensOnce(Ramp):
    opened = False

    def _open(self) -> None:
        if self.opened:
            raise DeviceError("busy")
        self.opened = True
        super()._open()


class ClosesOnce(Ramp):
    def close(self) -> None:
        if not self.is_open:
            raise DeviceError("not open")
        super().close()


class ForgetsHalf(Ramp):
    """Releases only what an opening that succeeded has acquired."""

    ready = False

    def open(self) -> Any:
        super().open()
        self.ready = True
        return self

    def _close(self) -> None:
        if self.ready:
            super()._close()


class DeletesUnset(Ramp):
    def _close(self) -> None:
        super()._close()
        del self._sequence


class LeaksThread(Ramp):
    def _open(self) -> None:
        super()._open()
        threading.Thread(target=time.sleep, args=(4,), name="forgotten", daemon=True).start()


class LeaksFile(Ramp):
    def _open(self) -> None:
        super()._open()
        os.open(DRIVER, os.O_RDONLY)


class Floats(Ramp):
    def _pixels(self) -> Any:
        return np.zeros((6, 8), np.float32)


class FourChannels(Ramp):
    def _pixels(self) -> Any:
        return np.zeros((6, 8, 4), np.uint8)


class NoImage(Ramp):
    def _image(self) -> Any:
        return self._pixels()


class OneBuffer(Ramp):
    buffer = np.zeros((6, 8), np.uint8)

    def _pixels(self) -> Any:
        self.buffer[:] = self._sequence % 256
        return self.buffer


class ClockBackwards(Ramp):
    def _image(self) -> Image:
        backwards_s = time.monotonic() - 0.5 * self._sequence
        return Image(self._pixels(), backwards_s, time.time(), self._sequence)


class WallClock(Ramp):
    def _image(self) -> Image:
        return Image(self._pixels(), time.time(), time.time(), self._sequence)


class Uncounted(Ramp):
    def _image(self) -> Image:
        return Image(self._pixels(), time.monotonic(), time.time())


class ReadsClosed(Ramp):
    def read(self, timeout_s: float = 1.0) -> Image | None:
        if not self.is_open:
            return Image(np.zeros((6, 8), np.uint8))
        return super().read(timeout_s)


class Impatient(Ramp):
    def _late(self) -> Image | None:
        raise queue.Empty


class EndsEarly(Ramp):
    def _late(self) -> Image | None:
        return None


class Waits(Ramp):
    """Waits for the next image however long that takes."""

    def _read(self, timeout_s: float) -> Image | None:
        time.sleep(0.7 if timeout_s < 0.005 else 0)
        return super()._read(1.0)


class WaitsWhenStalled(Ramp):
    def _read(self, timeout_s: float) -> Image | None:
        return super()._read(0.9 if self.stalled else timeout_s)


class Misarmed(Ramp):
    def _arm(self, exposures: tuple[object, ...]) -> Trigger:
        return None
