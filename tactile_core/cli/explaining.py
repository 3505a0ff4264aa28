"""One sentence and an exit code for whatever ended a command."""

from __future__ import annotations

import io
from typing import Any

from tactile_core.cli.guard import Carried
from tactile_core.cli.output import StdoutClosed, let_go_of_stdout, tell
from tactile_core.cli.signals import Signalled
from tactile_core.errors import TactileError, words_of


def explain(caught: BaseException, debug: bool) -> int:
    """Tell what went wrong and return the exit code.

    Parameters
    ----------
    caught : BaseException
        What the command line raised; what its command raised is inside of :class:`Carried`.
    debug : bool
        Show the traceback, too.
    """
    error = caught.error if isinstance(caught, Carried) else caught
    let_go_of_stdout()
    if isinstance(error, Signalled):
        return error.exit_code
    if isinstance(error, StdoutClosed) or isinstance(caught, SystemExit):
        # nobody reads on, so there is nothing more to do; typer says it by an exit of its own
        return 0
    if debug:
        import traceback

        tell("".join(traceback.format_exception(error)).rstrip())
    return _told(error)


def _told(error: BaseException) -> int:
    if isinstance(error, TactileError):
        tell(f"tactile: {error}")
        return error.exit_code
    if isinstance(error, MemoryError):
        tell("tactile: there is not enough memory for this; give smaller images or fewer of them")
        return 1
    if isinstance(error, OSError):
        where = f" ({error.filename})" if error.filename else ""
        tell(f"tactile: {error.strerror or error}{where}")
        return 1
    code = _told_usage(error)
    if code is not None:
        return code
    said = "; ".join([words_of(error), *getattr(error, "__notes__", ())])
    if isinstance(error, KeyboardInterrupt):
        tell(f"tactile: {said}, though nobody interrupted it; this is a fault of its author")
    else:
        tell(f"tactile: {said} (this is a bug; run again with --debug and report what it prints)")
    return 1


def _told_usage(error: Any) -> int | None:
    """Show what the library that reads the command line says of a wrong call."""
    if not (hasattr(error, "show") and isinstance(getattr(error, "exit_code", None), int)):
        return None
    shown = io.StringIO()
    error.show(shown)
    tell(shown.getvalue().rstrip())
    return int(error.exit_code)
