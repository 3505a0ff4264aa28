"""What a command prints: tables, progress, messages, paths."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from time import monotonic
from typing import TYPE_CHECKING, Any, Self, TextIO

from tactile_core.errors import InputError
from tactile_core.formats.text import plain, printable

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress


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


def table_lines(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table: the first column left-aligned, the others right-aligned."""
    lines = [list(header), *map(list, rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    return [
        "  ".join(
            f"{cell:<{width}}" if column == 0 else f"{cell:>{width}}"
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    ]


class Bar:
    """A :class:`tactile_core.interfaces.calibration.Progress` that draws on stderr."""

    def __init__(self) -> None:
        self._start = monotonic()
        self._bar: RichProgress | None = None
        self._words, self._share, self._done = "", 0.0, 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def stage(self, words: str, share: float) -> None:
        """Begin a stage that takes about this share, 0..1, of the whole work."""
        self._done += self._share
        self._words, self._share = words, share
        self.fraction(0.0)

    def fraction(self, done: float) -> None:
        """Set the completed fraction of the current stage, 0..1."""
        # [s] short work needs no bar
        if self._bar is None and sys.stderr.isatty() and monotonic() - self._start > 1.0:
            self._begin()
        if self._bar is not None:
            self._bar.update(
                self._bar.task_ids[0],
                description=self._words,
                completed=self._done + done * self._share,
            )

    def _begin(self) -> None:
        from rich.console import Console
        from rich.progress import Progress as RichProgress

        self._bar = RichProgress(console=Console(stderr=True), transient=True)
        self._bar.add_task(self._words, total=1.0)
        self._bar.start()


LONGEST_NAME = 255  # Longest file name that file systems accept, bytes


def refuse_impossible(words: Sequence[str]) -> None:
    """Refuse empty words, which would mean the current folder, and overlong file names.

    Raises
    ------
    InputError
        A word is empty or too long; the message names the option in front of it.
    """
    for before, word in zip(("", *words), words, strict=False):
        option, equals, value = word.partition("=") if word.startswith("--") else (before, "", word)
        where = option if option.startswith("--") else "an argument"
        if not value and (equals or not word):
            raise InputError(f"{where} is empty; give a value, or leave it out")
        longest = max(value.split("/"), key=len)
        if len(os.fsencode(longest)) > LONGEST_NAME:
            raise InputError(
                f"{where}: the name {printable(longest[:40])}… is longer than the "
                f"{LONGEST_NAME} bytes that a file's name can have; shorten it"
            )
