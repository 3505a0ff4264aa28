"""What is tried: a command line or a call, what was spoilt before it, and what may come of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from fuzz.faults import Fault

Spoil = Callable[[Random], None]
REFUSED = frozenset({0, 2})
"""A mutation may be harmless; one that is not is the user's to put right."""


def nothing(rng: Random) -> None:
    """Spoil nothing."""


@dataclass
class Attempt:
    """One case, ready to run in its sandbox.

    Attributes
    ----------
    words : list of str
        The command line, without ``tactile``.
    call : callable, optional
        A Python entry point instead of a command line; what it returns is thrown away.
    spoil : callable
        Changes the inputs in one way; called once more for each further number of the case.
    codes : set of int
        Exit statuses that are right; a negative one is a signal's.
    ours : tuple of Path
        What an earlier run of the same command wrote, which this one may replace.
    named : tuple of str
        A refusal has to name each of these.
    wires : str
        What is wrong with stdout or stderr.
    signal : (number, seconds), optional
        Sent from outside.
    times : int
        How many processes do the same at once.
    alone : bool
        In an interpreter of its own, as from a shell.
    environment : dict
    plugins : tuple of Path
        Put on the import path.
    cpu_s : int
        More counts as a hang.
    may_litter : bool
        Nobody can tidy up after SIGKILL.
    """

    words: list[str] = field(default_factory=list)
    call: Callable[[], Any] | None = None
    spoil: Spoil = nothing
    codes: frozenset[int] = REFUSED
    ours: tuple[Path, ...] = ()
    named: tuple[str, ...] = ()
    fault: Fault | None = None
    wires: str = ""
    signal: tuple[int, float] | None = None
    times: int = 1
    alone: bool = False
    environment: dict[str, str] = field(default_factory=dict)
    plugins: tuple[Path, ...] = ()
    cpu_s: int = 10
    may_litter: bool = False

    @property
    def out(self) -> Path | None:
        """Where the command was told to write."""
        for at, word in enumerate(self.words):
            if word == "--out" and at + 1 < len(self.words):
                return Path(self.words[at + 1])
        return None

    def said(self) -> str:
        """How a user would have typed it."""
        return "tactile " + " ".join(map(ascii, self.words)) if self.call is None else "a call"
