"""Errors raised on purpose; each message is one clear sentence.

The command line prints the message of a :class:`TactileError` and exits with its code: 2 if the
user's input is unusable, 1 if the work itself failed (a device, a disk).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Place:
    """A position in a file.

    Attributes
    ----------
    file : Path
    line, column : int
        From 1; 0 if the position within the file is unknown.
    """

    file: Path
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}" if self.line else str(self.file)


@dataclass(frozen=True)
class Problem:
    """One mistake in a profile.

    Attributes
    ----------
    file : Path
    line, column : int
        From 1; 0 if the position within the file is unknown.
    key : str
        For example ``image.width_px``; empty if the problem concerns the whole file.
    message : str
        What is wrong and how to fix it.
    """

    file: Path
    line: int
    column: int
    key: str
    message: str

    def __str__(self) -> str:
        place = Place(self.file, self.line, self.column)
        return f"{place}: {self.key}: {self.message}" if self.key else f"{place}: {self.message}"


class TactileError(Exception):
    """Base of all errors raised on purpose; the message says what to do."""

    exit_code = 2


class InputError(TactileError):
    """A file, folder or argument that the user gave cannot be used."""


class SequenceError(InputError):
    """An exposure of a light sequence is dark or shows the wrong light."""


class PluginError(TactileError):
    """A plugin is missing or cannot be imported, or two plugins claim one name."""


class PluginFault(PluginError):
    """A plugin's code failed at run time, or returned a value that its interface forbids."""

    exit_code = 1


class ProfileError(TactileError):
    """A profile is invalid; :attr:`problems` lists every mistake."""

    def __init__(self, message: str, problems: Sequence[Problem] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(problems)


class CalibrationError(TactileError):
    """Presses cannot be fitted, or a bundle is damaged, belongs to another unit or is newer."""


class DeviceError(TactileError):
    """A camera or light failed."""

    exit_code = 1


class CameraTimeout(DeviceError):
    """No new frame arrived within the timeout."""


class CameraLost(DeviceError):
    """The camera was unplugged or its recording ended."""


class LightsLost(DeviceError):
    """The light box was unplugged."""


class LibraryMissing(DeviceError):
    """An optional library that the device needs is not installed."""


class DeviceAbsent(DeviceError):
    """No connected device is the one that is meant, or several may be."""


class DeviceForbidden(DeviceError):
    """The user has no permission to open the device."""


class DeviceBusy(DeviceError):
    """The device is open in another process or object."""


class BandwidthError(DeviceError):
    """The camera is open but sends nothing, as when others take the bandwidth of its USB hub."""


def words_of(error: BaseException) -> str:
    """Return an exception's type and message in one line."""
    try:
        message = " ".join(str(error).split())
    except Exception:  # a plugin's own exception can fail to format itself
        message = ""
    return f"{type(error).__name__}: {message or 'no reason given'}"
