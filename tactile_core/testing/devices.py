"""Checks of opening and closing cameras and light drivers."""

from __future__ import annotations

from typing import Any

from tactile_core.errors import DeviceError
from tactile_core.interfaces.device import Device
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.faults import CannotCheck, Fault
from tactile_core.testing.footprint import Footprint
from tactile_core.testing.registered import Part, Registered

_ROUNDS = 2  # Number of repeated openings in the check of leaks


class DeviceChecks(Suite):
    """Opening, closing and released resources."""

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
                    why="a program could not continue after it loses its camera for a moment",
                    do="release in _close everything that _open acquires; without the hardware, "
                    f"set options = {{{part.use!r}: {{…}}}} for an emulator, or add the check to "
                    "expected_failures",
                ) from error

    @check(Registered.devices)
    def test_closing_twice(self, part: Part) -> None:
        """Closing a device twice, or before opening it, does nothing."""
        device = self.registered.device(part)
        try:
            device.close()
            opened(device).close()
            device.close()
        except CannotCheck:
            raise
        except Exception as error:
            raise Fault(
                part,
                f"closing it twice, or before it was opened, fails ({error!r})",
                why="cleanup after another error would hide that error",
                do="do not override close(); implement _close(), which is called once",
            ) from error

    @check(Registered.devices)
    def test_failed_opening(self, part: Part) -> None:
        """A failed opening, early or late, leaves nothing open and keeps its own error."""
        opened(self.registered.device(part)).close()
        for late in (False, True):
            device = _refusing(self.registered.device(part), late=late)
            before = Footprint.now()
            when = "after acquiring everything" if late else "before acquiring anything"
            try:
                device.open()
            except DeviceError as error:
                notes = " ".join(getattr(error, "__notes__", ()))
            if notes:
                raise Fault(
                    part,
                    f"_open failed {when}, and then {notes}",
                    why="_close is also called after an _open that failed halfway",
                    do="set the attributes that _close uses in __init__, and release only those "
                    "that _open acquired",
                )
            left = before.left()
            if left or device.is_open:
                raise Fault(
                    part,
                    f"_open failed {when}, and left {left or 'the device open'}",
                    why="the next attempt finds the device busy",
                    do="release everything in _close, also after an _open that failed halfway",
                )

    @check(Registered.devices)
    def test_leaks(self, part: Part) -> None:
        """Closing a device ends all its threads and closes all its files."""
        device = self.registered.device(part)
        use(device)  # the first opening acquires what libraries keep until the process ends
        for _ in range(_ROUNDS):
            before = Footprint.now()
            use(device)
            left = before.left()
            if left:
                raise Fault(
                    part,
                    f"after close() there is still {left}",
                    why="a program that opens it often runs out of resources, and a remaining "
                    "thread can keep the device busy",
                    do="close the files and end the threads in _close, and wait for the threads",
                )


def opened(device: Device) -> Any:
    """Open a device.

    Raises
    ------
    CannotCheck
        It does not open.
    """
    try:
        return device.open()
    except Exception as error:
        raise CannotCheck(f"see the check 'opening': {error}") from error


def use(device: Device) -> None:
    """Open a device, read or set levels once, and close it."""
    with opened(device) as ready:
        try:
            if hasattr(ready, "read"):
                ready.read(5.0)
            else:
                ready.set({})
        except Exception as error:
            raise CannotCheck(f"see the checks of this {type(device).__name__}: {error}") from error


def _refusing(device: Device, *, late: bool) -> Device:
    """Let the device's next opening fail before or after its own ``_open``."""
    acquire = device._open

    def refuse() -> None:
        if late:
            acquire()
        raise DeviceError("the conformance kit makes this opening fail")

    device._open = refuse  # type: ignore[method-assign]
    return device
