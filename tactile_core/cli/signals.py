"""Signals that end a command become exceptions, so that lights go dark and files are cleared up."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")


class Signalled(KeyboardInterrupt):
    """The user or the system ends the command.

    A :class:`KeyboardInterrupt`, which code that has something to put in order expects.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.exit_code = 128 + number


@contextmanager
def signals_raised() -> Iterator[list[Signalled]]:
    """Raise :class:`Signalled` for each signal that ends a program, if it is not ignored.

    Yields those that came.
    """
    came: list[Signalled] = []

    def handle(number: int, frame: FrameType | None) -> None:
        came.append(Signalled(number))
        raise came[-1]

    before = {}
    for name in _NAMES:
        number = getattr(signal, name, None)
        # nohup and background jobs of a shell ignore some on purpose
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            with suppress(ValueError):  # only the main thread may handle signals
                before[number] = signal.signal(number, handle)
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
