"""The output of a command: its data on stdout, everything else on stderr."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from tactile_core.formats.json import plain
from tactile_core.formats.printable import printable

# Streams for data inside only_data_on_stdout; the last one is in use.
_data: list[TextIO | None] = []


class StdoutClosed(Exception):
    """The reader of stdout closed it."""


@contextmanager
def only_data_on_stdout() -> Iterator[None]:
    """Reserve stdout for :func:`print_data`; prints of libraries and plugins go to stderr."""
    stdout = sys.stdout
    _data.append(_apart(stdout))
    sys.stdout = sys.stderr
    try:
        yield
    finally:
        # the original descriptor stays on stderr: C code may not have flushed its output yet
        sys.stdout = _data.pop() or stdout


def terminal() -> TextIO | None:
    """Return the stream of :func:`print_data` if a user looks at it."""
    stream = _data[-1] if _data else sys.stdout
    return stream if stream is not None and stream.isatty() else None


def print_data(line: str) -> None:
    """Print a line of data.

    Raises
    ------
    StdoutClosed
        Stdout is closed.
    """
    stream = _data[-1] if _data else sys.stdout
    if stream is None:
        raise StdoutClosed
    try:
        stream.write(printable_lines(line).replace("\n", "\\n") + "\n")
        stream.flush()
    except BrokenPipeError:
        raise StdoutClosed from None


def print_json(value: Any, *, indent: int | None = None) -> None:
    """Print strict JSON, on one line unless it is indented."""
    for line in json.dumps(plain(value), allow_nan=False, indent=indent).split("\n"):
        print_data(line)


def print_message(words: str, *, end: str = "\n") -> None:
    """Print a message for the user on stderr."""
    if sys.stderr is None:
        return
    with suppress(BrokenPipeError):
        print(printable_lines(words), end=end, file=sys.stderr, flush=True)


def ask(question: str) -> str:
    """Ask on stderr, for stdout is for data, and return the line that the user types."""
    print_message(question, end=" ")
    return sys.stdin.readline().strip()


class Warnings:
    """Prints the warnings of readings, each once: one whose numbers change is the same.

    Parameters
    ----------
    known : iterable of str
        What the user has read already.
    """

    def __init__(self, known: Iterable[str]) -> None:
        self._said = {_without_numbers(sentence) for sentence in known}

    def print(self, sentences: Iterable[str]) -> None:
        """Print those that are new."""
        for sentence in sentences:
            words = _without_numbers(sentence)
            if words not in self._said:
                self._said.add(words)
                print_message(f"warning: {sentence}")


def _without_numbers(sentence: str) -> str:
    return re.sub(r"\d+([.,]\d+)*", "#", sentence)


def print_if_fewer(came: int, asked: int | None, seconds: float | None = None) -> None:
    """Report that fewer frames came than the user asked for, or that they ended too soon."""
    if (asked is not None and came < asked) or (asked is None and seconds is not None):
        what = (
            f"{came} frames in --seconds {seconds:g}"
            if asked is None
            else (f"{came} of the {asked} frames of --frames")
        )
        print_message(
            f"note: only {what} came, because the recording or the movement of the virtual "
            f"sensor ended; --script gives it a longer one"
        )


def printable_lines(text: str) -> str:
    """Escape control and invisible characters, except line breaks."""
    return "\n".join(map(printable, text.split("\n")))


def flush_stdout() -> None:
    """Flush stdout, or drop its content if it is closed, so the interpreter exits quietly."""
    stream: TextIO | None = sys.stdout
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _apart(stdout: TextIO | None) -> TextIO | None:
    """Give data its own descriptor and point the original, which C code uses, to stderr."""
    if stdout is None or sys.__stdout__ is None or stdout is not sys.__stdout__:
        return stdout  # missing, or already captured
    stdout.flush()
    number, encoding = stdout.fileno(), stdout.encoding
    stream = os.fdopen(os.dup(number), "w", encoding=encoding, errors="backslashreplace")
    stderr = sys.stderr
    os.dup2(os.open(os.devnull, os.O_WRONLY) if stderr is None else stderr.fileno(), number)
    return stream
