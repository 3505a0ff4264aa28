"""Everything that can go wrong, said in one clear sentence.

The command line turns a :class:`TactileError` into its message and an exit code: 2 where
something that the user gave is unusable, 1 where the work itself failed (a device, a disk).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tactile_core.profiles.source import Problem


class TactileError(Exception):
    """Base of all errors raised on purpose; its message says what to do."""

    exit_code = 2


class InputError(TactileError):
    """A file, folder or argument that the user gave cannot be used."""


class SequenceError(InputError):
    """An exposure of lights fired in turn is dark or shows another light than its own."""


class PluginError(TactileError):
    """A plugin cannot be imported, is missing, or two claim one name."""


class PluginFault(PluginError):
    """A plugin's code failed while working, or returned what its interface does not allow."""

    exit_code = 1


class ProfileError(TactileError):
    """A profile has mistakes; :attr:`problems` lists every one of them."""

    def __init__(self, message: str, problems: Sequence[Problem] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(problems)


class CalibrationError(TactileError):
    """Presses cannot be fitted, or a bundle is broken, foreign or newer."""


class DeviceError(TactileError):
    """A camera or light failed while working."""

    exit_code = 1


class CameraTimeout(DeviceError):
    """No fresh frame arrived within the time allowed."""


class CameraLost(DeviceError):
    """The camera was unplugged or its recording ended."""


class DeviceBusy(DeviceError):
    """Another process or object holds the device."""


def words_of(error: BaseException) -> str:
    """Return an exception's type and message in one line."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said or 'no reason given'}"
