"""Turns signals that end a command into exceptions, so that lights and files are cleaned up."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")


class Signalled(KeyboardInterrupt):
    """The user or the system ends the command.

    Derives from :class:`KeyboardInterrupt`, which cleanup code already handles.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number
        self.exit_code = 128 + number


@contextmanager
def signals_raised() -> Iterator[list[Signalled]]:
    """Raise :class:`Signalled` for each signal that ends a program, unless it is ignored.

    Yields the list of received signals.
    """
    received: list[Signalled] = []

    def handle(number: int, frame: FrameType | None) -> None:
        received.append(Signalled(number))
        raise received[-1]

    before = {}
    for name in _NAMES:
        number = getattr(signal, name, None)
        # nohup and background jobs of a shell deliberately ignore some signals
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            with suppress(ValueError):  # only the main thread may handle signals
                before[number] = signal.signal(number, handle)
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def interrupt_ends() -> Iterator[None]:
    """Take the user's Ctrl-C for the regular end of a command that would never end."""
    try:
        yield
    except Signalled as signalled:
        if signalled.number != signal.SIGINT:
            raise
        signalled.exit_code = 0
