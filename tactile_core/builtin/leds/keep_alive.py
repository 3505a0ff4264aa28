"""A thread that keeps a box of LEDs alive."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

from tactile_core.errors import DeviceError


class KeepAlive:
    """Calls a function at an interval from construction until :meth:`stop`.

    Parameters
    ----------
    beat : callable
        May raise :class:`~tactile_core.errors.DeviceError`, which :meth:`check` raises again. The
        function is still called thereafter: the box may respond again.
    interval_s : float
    """

    def __init__(self, beat: Callable[[], None], interval_s: float) -> None:
        self._beat = beat
        self._interval_s = interval_s
        self._stopped = Event()
        self._fault: DeviceError | None = None
        self._thread = Thread(target=self._run, name="keep-alive of the lights", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Raise the error of the latest failed call, once.

        Raises
        ------
        DeviceError
            The box did not respond since the last check.
        """
        fault, self._fault = self._fault, None
        if fault is not None:
            raise fault

    def stop(self) -> None:
        """End the thread and wait for it; as long as one call takes at most."""
        self._stopped.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stopped.wait(self._interval_s):
            try:
                self._beat()
            except DeviceError as error:
                self._fault = error
