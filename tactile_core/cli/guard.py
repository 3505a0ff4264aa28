"""What a command raises, carried past the library that reads the command line."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import typer

from tactile_core.cli.output import only_data_on_stdout


class Carried(Exception):
    """What a command raised.

    The library that reads the command line takes an end of file for an interrupt, a broken pipe
    for a closed stdout and an exit for the command's own; here they may be anybody's.
    """

    def __init__(self, error: BaseException) -> None:
        super().__init__(str(type(error)))
        self.error = error


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Let a command have stdout for its data alone, and whatever it raises arrive unchanged."""

    @wraps(command)
    def inside(*arguments: Any, **options: Any) -> None:
        try:
            with only_data_on_stdout():
                command(*arguments, **options)
        except typer.Exit:
            raise
        except BaseException as error:
            raise Carried(error) from None

    return inside
