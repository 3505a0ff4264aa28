"""Explains failures in one sentence each."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import wraps
from typing import Any

import typer

from tactile_core.cli.output import StdoutClosed, flush_stdout, only_data_on_stdout, print_message
from tactile_core.cli.signals import Signalled
from tactile_core.errors import TactileError, words_of
from tactile_core.plugins.blame import fault, is_of_the_machine
from tactile_core.plugins.entry_points import opencv_fault_behind


class Carried(Exception):
    """Wraps the exception of a command.

    Typer treats EOFError as an interrupt, a broken pipe as a closed stdout and SystemExit as the
    end of the command, but a plugin or a library can raise them for other reasons.
    """

    def __init__(self, error: BaseException, command: Callable[..., None]) -> None:
        super().__init__(str(type(error)))
        self.error, self.command = error, command


def guard_command(command: Callable[..., None]) -> Callable[..., None]:
    """Reserve stdout for a command's data and carry its exceptions past typer unchanged."""

    @wraps(command)
    def inside(*arguments: Any, **options: Any) -> None:
        try:
            with only_data_on_stdout():
                command(*arguments, **options)
        except typer.Exit:
            raise
        except BaseException as error:
            raise Carried(error, command) from None

    return inside


def explain(caught: BaseException, debug: bool) -> int:
    """Print the error message and return the exit code.

    Parameters
    ----------
    caught : BaseException
        The exception of the command line; a command's own exception comes inside a
        :class:`Carried`.
    debug : bool
        Print the traceback as well.
    """
    error, command = (
        (caught.error, caught.command) if isinstance(caught, Carried) else (caught, None)
    )
    flush_stdout()
    if isinstance(error, Signalled):
        return error.exit_code
    if isinstance(error, StdoutClosed) or isinstance(caught, SystemExit):
        # stdout is closed, so there is nothing more to do; typer reports it with SystemExit
        return 0
    if debug:
        import traceback

        print_message("".join(traceback.format_exception(error)).rstrip())
    return _report_error(error, command)


def _report_error(error: BaseException, command: Callable[..., None] | None) -> int:
    from tactile_core.plugins.registry import origin_of

    of_plugin = command is not None and not origin_of(command).is_core
    if isinstance(error, TactileError):
        print_message(f"tactile: {error}")
        return error.exit_code
    opencv = opencv_fault_behind(error)
    if opencv:
        print_message(f"tactile: {opencv}")
        return 1
    if isinstance(error, typer.Abort):  # the user denies a question of a plugin's command
        print_message("tactile: ended at a question")
        return 1
    if isinstance(error, MemoryError):
        print_message(
            "tactile: there is not enough memory for this; give smaller images or fewer of them"
        )
        return 1
    if isinstance(error, FileExistsError) and error.filename:
        # made by another command since this one looked
        print_message(f"tactile: {error.filename} already exists; name another one")
        return 2
    if isinstance(error, OSError) and (error.filename or is_of_the_machine(error) or not of_plugin):
        where = f" ({error.filename})" if error.filename else ""
        print_message(f"tactile: {error.strerror or words_of(error)}{where}")
        return 1
    code = _reported_usage(error)
    if code is not None:
        return code
    if of_plugin:
        return _report_error(fault("the command", command, f"failed: {words_of(error)}"), None)
    message = "; ".join([words_of(error), *getattr(error, "__notes__", ())])
    if isinstance(error, KeyboardInterrupt):
        print_message(
            f"tactile: {message}, without an interrupt from the user; this is a bug of its author"
        )
    else:
        print_message(
            f"tactile: {message} (this is a bug; run again with --debug and report the output)"
        )
    return 1


def _reported_usage(error: Any) -> int | None:
    """Print typer's message about a wrong call; None for any other error."""
    if not (hasattr(error, "show") and isinstance(getattr(error, "exit_code", None), int)):
        return None
    shown = io.StringIO()
    error.show(shown)
    print_message(shown.getvalue().rstrip())
    return int(error.exit_code)
