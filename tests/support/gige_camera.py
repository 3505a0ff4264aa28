"""Aravis's own emulated GigE Vision camera on this machine; run as a program with a serial."""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
from collections.abc import Callable
from typing import Any, Self

import numpy as np

from tactile_core.builtin.cameras.genicam_source import library

ADDRESS = "127.0.0.1"
_FILL = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 2, *[ctypes.c_uint32] * 3)


class PaintedCamera:
    """A camera whose pictures a function paints, in this process.

    Parameters
    ----------
    paint : callable
        Receives the exposure time in µs and returns the level of the whole image.
    size : int
        Pixels of an image.
    """

    def __init__(self, serial: str, paint: Callable[[float], int], size: int) -> None:
        aravis = library()
        aravis_c = ctypes.CDLL("libaravis-0.8.so.0")
        aravis_c.arv_buffer_get_data.restype = ctypes.c_void_p
        aravis_c.arv_buffer_get_data.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
        aravis_c.arv_fake_camera_set_fill_pattern.argtypes = [ctypes.c_void_p] * 3

        def fill(buffer: int, _: Any, exposure_us: int, gain: int, form: int) -> None:
            start = aravis_c.arv_buffer_get_data(buffer, None)
            level = paint(exposure_us)
            np.ctypeslib.as_array((ctypes.c_uint8 * size).from_address(start))[:] = level

        self._fill = _FILL(fill)  # Aravis keeps only its address
        self._server = aravis.GvFakeCamera.new(ADDRESS, serial)
        aravis_c.arv_fake_camera_set_fill_pattern(
            hash(self._server.get_fake_camera()), ctypes.cast(self._fill, ctypes.c_void_p), None
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
