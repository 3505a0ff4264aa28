"""Everything that can go wrong, said in one clear sentence.

The command line turns a :class:`TactileError` into its message and an exit code: 2 where
something that the user gave is unusable, 1 where the work itself failed (a device, a disk).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Place:
    """Where something stands in a file.

    Attributes
    ----------
    file : Path
    line, column : int
        From 1; 0 for what stands in no file.
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
        From 1; 0 for what stands in no file.
    key : str
        E.g. ``image.width_px``; empty where the file as a whole is meant.
    message : str
        What is wrong and what to do, in plain words.
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
    try:
        said = " ".join(str(error).split())
    except Exception:  # a plugin's own exception, whose words are its code
        said = ""
    return f"{type(error).__name__}: {said or 'no reason given'}"
