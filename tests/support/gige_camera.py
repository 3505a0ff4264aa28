"""Aravis's own emulated GigE Vision camera on this machine; run as a program with a serial."""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import DeviceError
from tactile_genicam.image_source import library

ADDRESS = "127.0.0.1"
Painted = int | NDArray[np.uint8] | NDArray[np.uint16]
TRIGGER_HZ = 1000.0
"""Rate at which a camera looks for software triggers."""

_FILL = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 2, *[ctypes.c_uint32] * 3)


@contextmanager
def alone() -> Iterator[None]:
    """Emulated cameras share one port, so only one test on this computer may use it."""
    import fcntl  # there is none on Windows

    with (Path(tempfile.gettempdir()) / "tactile-gige-camera.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def missing() -> str:
    """Return what is not installed and how to install it, or ""."""
    try:
        library()
    except DeviceError as error:
        return str(error)
    return ""


class PaintedCamera:
    """A camera whose pictures a function paints, in this process.

    Parameters
    ----------
    paint : callable
        Receives the exposure time in µs and returns the pixels, or one level for all.
    size : int
        Bytes of an image.
    """

    def __init__(self, serial: str, paint: Callable[[float], Painted], size: int) -> None:
        aravis = library()
        aravis_c = ctypes.CDLL("libaravis-0.8.so.0")
        aravis_c.arv_buffer_get_data.restype = ctypes.c_void_p
        aravis_c.arv_buffer_get_data.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
        aravis_c.arv_fake_camera_set_fill_pattern.argtypes = [ctypes.c_void_p] * 3

        def fill(buffer: int, _: Any, exposure_us: int, gain: int, form: int) -> None:
            start = aravis_c.arv_buffer_get_data(buffer, None)
            painted = paint(exposure_us)
            there = np.ctypeslib.as_array((ctypes.c_uint8 * size).from_address(start))
            there[:] = painted if isinstance(painted, int) else painted.view(np.uint8).ravel()

        self._fill = _FILL(fill)  # Aravis keeps only its address
        self._server = aravis.GvFakeCamera.new(ADDRESS, serial)
        camera = self._server.get_fake_camera()
        camera.set_trigger_frequency(TRIGGER_HZ)
        aravis_c.arv_fake_camera_set_fill_pattern(
            hash(camera), ctypes.cast(self._fill, ctypes.c_void_p), None
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        del self._server  # nothing else refers to it, so it ends


class OtherProcess:
    """A camera in a process of its own, which a test can stop, continue and kill."""

    def __init__(self, serial: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, __file__, serial], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == b"ready\n"

    def pause(self) -> None:
        self._process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        self._process.send_signal(signal.SIGCONT)

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._process:
            self._process.kill()


if __name__ == "__main__":
    server = library().GvFakeCamera.new(ADDRESS, sys.argv[1])
    assert server.is_running()
    print("ready", flush=True)
    sys.stdin.read()
