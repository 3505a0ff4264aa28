"""What a command prints: its data alone on stdout, words and all else on stderr."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from tactile_core.formats.json import plain
from tactile_core.formats.printable import printable

_data: list[TextIO | None] = []
"""Where data goes while :func:`only_data_on_stdout` keeps all else away; the last one counts."""


class StdoutClosed(Exception):
    """Whoever read the data has gone."""


@contextmanager
def only_data_on_stdout() -> Iterator[None]:
    """Keep stdout for :func:`say`: what libraries and plugins print goes to stderr."""
    stdout = sys.stdout
    _data.append(_apart(stdout))
    sys.stdout = sys.stderr
    try:
        yield
    finally:
        # not what it was before: its descriptor is stderr's now, and what C code has printed and
        # not flushed yet must go there
        sys.stdout = _data.pop() or stdout


def say(line: str) -> None:
    """Print a line of data.

    Raises
    ------
    StdoutClosed
        Nobody reads it.
    """
    stream = _data[-1] if _data else sys.stdout
    if stream is None:
        raise StdoutClosed
    try:
        stream.write(printable_lines(line).replace("\n", "\\n") + "\n")
        stream.flush()
    except BrokenPipeError:
        raise StdoutClosed from None


def say_json(value: Any, *, indent: int | None = None) -> None:
    """Print strict JSON, on one line unless it is indented."""
    for line in json.dumps(plain(value), allow_nan=False, indent=indent).split("\n"):
        say(line)


def tell(words: str, *, end: str = "\n") -> None:
    """Print words for people."""
    if sys.stderr is None:
        return
    with suppress(BrokenPipeError):
        print(printable_lines(words), end=end, file=sys.stderr, flush=True)


def printable_lines(text: str) -> str:
    """Escape what would steer a terminal or hide in a line; line breaks stay."""
    return "\n".join(map(printable, text.split("\n")))


def let_go_of_stdout() -> None:
    """Flush stdout, so that the interpreter has no reason to complain when it ends."""
    stream: TextIO | None = sys.stdout
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _apart(stdout: TextIO | None) -> TextIO | None:
    """Move stdout away from its descriptor, to which C code and other programs write."""
    if stdout is None or sys.__stdout__ is None or stdout is not sys.__stdout__:
        return stdout  # none, or captured already
    stdout.flush()
    number, encoding = stdout.fileno(), stdout.encoding
    stream = os.fdopen(os.dup(number), "w", encoding=encoding, errors="backslashreplace")
    stderr = sys.stderr
    os.dup2(os.open(os.devnull, os.O_WRONLY) if stderr is None else stderr.fileno(), number)
    return stream
