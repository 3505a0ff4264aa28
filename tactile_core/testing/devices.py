"""Checks of everything that is opened and closed: cameras and light drivers."""

from __future__ import annotations

from typing import Any

from tactile_core.errors import DeviceError
from tactile_core.interfaces.device import Device
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.footprint import Footprint
from tactile_core.testing.registered import Part, Registered

_ROUNDS = 2


class DeviceChecks(Suite):
    """Open, close, and what is left behind."""

    @check(Registered.devices)
    def test_opening(self, part: Part) -> None:
        """A device opens, closes, and opens again."""
        device = self.registered.device(part)
        for attempt in ("opens", "opens again after it was closed"):
            try:
                device.open()
                device.close()
            except Exception as error:
                raise Fault(
                    part,
                    f"it no longer {attempt} ({type(error).__name__}: {error})"
                    if "again" in attempt
                    else f"it does not open and close ({type(error).__name__}: {error})",
                    why="a program that loses its camera for a moment could not go on",
                    do="release in _close all that _open acquires and keep nothing of it; where "
                    f"no hardware is attached, give options = {{{part.use!r}: {{…}}}} for an "
                    "emulator, or say so in expected_failures",
                ) from error

    @check(Registered.devices)
    def test_closing_twice(self, part: Part) -> None:
        """A device may be closed when it is closed already, or was never open."""
        device = self.registered.device(part)
        try:
            device.close()
            opened(device).close()
            device.close()
        except Unjudged:
            raise
        except Exception as error:
            raise Fault(
                part,
                f"closing it twice, or before it was opened, fails ({error!r})",
                why="cleaning up after another error would hide that error",
                do="do not override close(); write _close(), which is called once",
            ) from error

    @check(Registered.devices)
    def test_failed_opening(self, part: Part) -> None:
        """An opening that fails, early or late, leaves nothing open and says its own reason."""
        opened(self.registered.device(part)).close()
        for late in (False, True):
            device = _refusing(self.registered.device(part), late=late)
            before = Footprint.now()
            when = "after all was acquired" if late else "before anything was acquired"
            try:
                device.open()
            except DeviceError as error:
                notes = " ".join(getattr(error, "__notes__", ()))
            if notes:
                raise Fault(
                    part,
                    f"_open failed {when}, and then {notes}",
                    why="_close is called after a half-finished _open, whatever that acquired",
                    do="set in __init__ what _close looks at, and release only what is there",
                )
            left = before.left()
            if left or device.is_open:
                raise Fault(
                    part,
                    f"_open failed {when}, and left {left or 'the device open'}",
                    why="the next attempt finds the device busy",
                    do="release in _close whatever is held, also after a half-finished _open",
                )

    @check(Registered.devices)
    def test_leaks(self, part: Part) -> None:
        """Closing ends every thread and closes every file."""
        device = self.registered.device(part)
        use(device)  # what a library keeps for good is acquired by the first opening
        for _ in range(_ROUNDS):
            before = Footprint.now()
            use(device)
            left = before.left()
            if left:
                raise Fault(
                    part,
                    f"after close() there is still {left}",
                    why="a program that opens it often runs out of them, and a thread that is "
                    "left holds the device",
                    do="end the threads and close the files in _close, and wait for their end",
                )


def opened(device: Device) -> Any:
    """Open a device.

    Raises
    ------
    Unjudged
        It does not open.
    """
    try:
        return device.open()
    except Exception as error:
        raise Unjudged(f"see the check 'opening': {error}") from error


def use(device: Device) -> None:
    """Open a device, read or switch once, and close it."""
    with opened(device) as ready:
        try:
            if hasattr(ready, "read"):
                ready.read(5.0)
            else:
                ready.set({})
        except Exception as error:
            raise Unjudged(f"see the checks of this {type(device).__name__}: {error}") from error


def _refusing(device: Device, *, late: bool) -> Device:
    """The same device, whose next opening fails before or after all that it does."""
    acquire = device._open

    def refuse() -> None:
        if late:
            acquire()
        raise DeviceError("the conformance kit lets this opening fail")

    device._open = refuse  # type: ignore[method-assign]
    return device
