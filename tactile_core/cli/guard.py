"""Carries a command's exceptions past typer, which would reinterpret some of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import typer

from tactile_core.cli.output import only_data_on_stdout


class Carried(Exception):
    """Wraps the exception of a command.

    Typer treats EOFError as an interrupt, a broken pipe as a closed stdout and SystemExit as the
    end of the command, but a plugin or a library can raise them for other reasons.
    """

    def __init__(self, error: BaseException) -> None:
        super().__init__(str(type(error)))
        self.error = error


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Reserve stdout for a command's data and carry its exceptions past typer unchanged."""

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
