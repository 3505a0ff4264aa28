"""An attempt: a command line or a call, its corrupted inputs, and its allowed results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from fuzz.faults import Fault

if TYPE_CHECKING:
    from fuzz.process import Outcome

Corrupt = Callable[[Random], None]
REFUSED = frozenset({0, 2})
"""Exit codes after a mutation: it may be harmless; otherwise it is a mistake of the user."""


def nothing(rng: Random) -> None:
    """Change nothing."""


@dataclass
class Attempt:
    """One case, ready to run in its sandbox.

    Attributes
    ----------
    words : list of str
        The command line, without ``tactile``.
    call : callable, optional
        A Python entry point instead of a command line; its result is discarded.
    corrupt : callable
        Applies one mutation to the inputs; called for each number of the case.
    codes : set of int
        Allowed exit statuses; a negative one is a signal.
    ours : tuple of Path
        Files of an earlier run of the same command, which this one may replace.
    named : tuple of str
        Names that a refusal must mention.
    wires : str
        Fault of stdout or stderr.
    signal : (number, seconds), optional
        Signal sent to the process, and its time.
    times : int
        Number of concurrent processes.
    alone : bool
        Run in a new interpreter, as from a shell.
    environment : dict
    plugins : tuple of Path
        Folders added to the import path.
    cpu_s : int
        Limit of CPU time; more counts as a hang.
    may_litter : bool
        Temporary files may remain, for example after SIGKILL.
    judge : callable
        Yields the promises of this area that a process has broken.
    """

    words: list[str] = field(default_factory=list)
    call: Callable[[], Any] | None = None
    corrupt: Corrupt = nothing
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
    judge: Callable[[Outcome], Iterator[str]] = lambda outcome: iter(())

    @property
    def out(self) -> Path | None:
        """The value of ``--out``, if there is one."""
        for at, word in enumerate(self.words):
            if word == "--out" and at + 1 < len(self.words):
                return Path(self.words[at + 1])
        return None

    def command_line(self) -> str:
        """Return the command line as a user would type it."""
        return "tactile " + " ".join(map(ascii, self.words)) if self.call is None else "a call"
