"""The command ``tactile``: data to stdout, words to stderr, one sentence when it fails."""

from __future__ import annotations

import os
import sys

from tactile_core.errors import TactileError


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit.

    Exit codes: 0 done; 2 something that the user gave is unusable; 1 it failed while working.
    """
    words = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in words
    sys.exit(_run([word for word in words if word != "--debug"], debug))


def _run(words: list[str], debug: bool) -> int:
    # Matrices here are small: more threads only wait for each other, several times as long when
    # anything else runs. Only the first import of numpy reads this.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    from typer import Abort

    from tactile_core.cli.app import app
    from tactile_core.cli.paths import refuse_impossible

    try:
        refuse_impossible(words)
        result = app(words, prog_name="tactile", standalone_mode=False)
    except (Abort, KeyboardInterrupt):  # Abort is what click makes of Ctrl-C
        return 130
    except Exception as error:
        if debug:
            raise
        return _explain(error)
    return result if isinstance(result, int) else 0


def _explain(error: Exception) -> int:
    if isinstance(error, TactileError):
        print(f"tactile: {error}", file=sys.stderr)
        return error.exit_code
    if isinstance(error, BrokenPipeError):
        sys.stdout = None  # nobody reads; do not complain at exit
        return 0
    if isinstance(error, OSError):
        where = f" ({error.filename})" if error.filename else ""
        print(f"tactile: {error.strerror or error}{where}", file=sys.stderr)
        return 1
    return _explain_usage(error)


def _explain_usage(error: Exception) -> int:
    show = getattr(error, "show", None)
    code = getattr(error, "exit_code", None)
    if isinstance(code, int):
        if show is not None:
            show()
        return code
    print(
        f"tactile: {type(error).__name__}: {error} (this is a bug; run again with --debug and "
        f"report what it prints)",
        file=sys.stderr,
    )
    return 1
