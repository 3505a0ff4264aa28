"""Opens the devices of a live sensor again after one of them was unplugged."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from tactile_core.acquisition.clock import HOST, Clock
from tactile_core.errors import CameraLost, DeviceError, InputError, LightsLost, TactileError
from tactile_core.quantities import Frame

LOST = (CameraLost, LightsLost)  # Errors after which the devices can be opened again


class RECONNECTION:
    """How devices are opened again."""

    # [s] Time between two attempts. Source: a small part of the second that a USB device takes to
    # start after it is plugged in.
    retry_s = 0.1


class Reconnection:
    """Closes and opens the devices until all are there, for a limited time.

    Parameters
    ----------
    patience_s : float
        Time from the loss to the last attempt; 0 for none. An attempt takes as long as opening.
    open, close : callable
        Open and close all devices; ``open`` leaves the work to ``close`` if it fails.
    clock : Clock
    """

    def __init__(
        self,
        patience_s: float,
        open: Callable[[], None],
        close: Callable[[], None],
        clock: Clock = HOST,
    ) -> None:
        if not patience_s >= 0:
            raise InputError(f"reconnect_s is {patience_s:g}; give the seconds, 0 for never")
        self._patience_s, self._clock = patience_s, clock
        self._open, self._close = open, close
        self._last_s = clock.now()
        self._lost = ""
        self._warning = ""

    def after(self, error: DeviceError) -> None:
        """Open the devices again.

        Raises
        ------
        DeviceError
            The given error: they cannot be opened in time, with the latest reason as a note.
        """
        if not self._patience_s:
            raise error
        until_s = self._clock.now() + self._patience_s
        self._lost = "the light box" if isinstance(error, LightsLost) else "the camera"
        while True:
            self._close_all()
            try:
                self._open()
            except TactileError as reason:
                left_s = until_s - self._clock.now()
                if left_s <= 0:
                    error.add_note(f"not opened again within {self._patience_s:g} s: {reason}")
                    raise error from reason
                self._clock.sleep(min(RECONNECTION.retry_s, left_s))
            else:
                return

    def saw(self, frame: Frame) -> None:
        """Note a frame; the first one after a loss ends the gap."""
        if self._lost:
            self._warning = (
                f"{self._lost} was lost, and there was no frame for "
                f"{frame.timestamp_s - self._last_s:.1f} s; reference and tare are kept, but slip "
                f"and whatever is measured from frame to frame have started again"
            )
            self._lost = ""
        self._last_s = frame.timestamp_s

    def warnings(self) -> tuple[str, ...]:
        """Return the warning for the first reading after a gap, once."""
        warning, self._warning = self._warning, ""
        return (warning,) if warning else ()

    def _close_all(self) -> None:
        with suppress(TactileError):  # what is gone may not close, and why it was lost is known
            self._close()
