"""An Arduino with its own firmware, in simavr, at a pseudo-terminal."""

from __future__ import annotations

import os
import shutil
import subprocess
import tty
from contextlib import suppress
from ctypes.util import find_library
from pathlib import Path
from typing import NamedTuple

SOURCE = Path(__file__).with_name("avr") / "board.c"
PINS = {(0, 0): 6, (0, 1): 5, (1, 0): 9, (1, 1): 10, (2, 0): 11, (2, 1): 3}
"""Arduino's number of the pin of each timer and channel."""


def missing() -> str:
    """Return what the simulation needs and is not installed, or ""."""
    tools = [tool for tool in ("avr-g++", "gcc") if shutil.which(tool) is None]
    libraries = [] if find_library("simavr") else ["simavr"]
    return ", ".join(tools + libraries)


def compile_firmware(source: Path, out: Path, **defined: str) -> Path:
    """Compile a sketch for the ATmega328P; all warnings are errors."""
    values = [f"-D{name}={value}" for name, value in defined.items()]
    flags = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["avr-g++", *flags, *values, "-o", out, source], check=True, timeout=60)
    return out


def compile_board(out: Path) -> Path:
    """Compile the program that simulates the board."""
    command = ["gcc", "-O1", "-o", out, SOURCE, "-l:libsimavr.so.2"]
    subprocess.run(command, check=True, timeout=60)
    return out


class Change(NamedTuple):
    """A change of the level at a pin, at a simulated time."""

    time_s: float
    pin: int
    level: int


class Board:
    """The board with a firmware, switched on until :meth:`close`.

    Attributes
    ----------
    port : str
        Name of its serial port.
    time_s : float
        Simulated time, about.
    changes : list of Change
        As far as :meth:`look` has read them.
    """

    def __init__(self, program: Path, firmware: Path) -> None:
        self._ends = os.openpty()
        for end in self._ends:
            tty.setraw(end)
        self.port = os.ttyname(self._ends[1])
        self._report, report = os.pipe()
        os.set_blocking(self._report, False)
        arguments = [program, firmware, str(self._ends[0]), str(report)]
        self._board = subprocess.Popen(arguments, pass_fds=(self._ends[0], report))
        os.close(report)
        self._text = ""
        self.time_s = 0.0
        self.changes: list[Change] = []

    def look(self) -> dict[int, int]:
        """Return the level at each pin that has had one."""
        with suppress(BlockingIOError):
            self._text += os.read(self._report, 1 << 16).decode()
        *lines, self._text = self._text.split("\n")
        for line in lines:
            time_us, *change = map(int, line.split())
            self.time_s = time_us / 1e6
            if change:
                timer, channel, level = change
                self.changes.append(Change(self.time_s, PINS[timer, channel], level))
        return {change.pin: change.level for change in self.changes}

    def close(self) -> None:
        """Switch it off."""
        self._board.kill()
        self._board.wait()
        for end in (*self._ends, self._report):
            os.close(end)
