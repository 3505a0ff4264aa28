"""The command ``tactile``: data on stdout, messages on stderr, one sentence per failure.

May import every room but testing.
"""

from __future__ import annotations

import os
import sys
import threading
from time import monotonic

from tactile_core.cli.signals import Signalled, signals_raised
from tactile_core.pipeline.one_thread import ONE_THREAD

_ENVIRONMENT = {
    **ONE_THREAD,
    # Silences OpenCV and FFmpeg, which would print next to the command's own error message.
    "OPENCV_LOG_LEVEL": "OFF",
    "OPENCV_FFMPEG_LOGLEVEL": "-8",
}


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit.

    Exit codes: 0 success; 2 unusable input (a wrong call, profile, bundle or file); 1 a failure
    while working (disk, device, lost connection); 128 plus the signal number after a signal.
    """
    words = sys.argv[1:] if arguments is None else arguments
    try:
        with signals_raised() as received:
            code = _run([word for word in words if word != "--debug"], "--debug" in words)
        if received:  # typer treats every signal as Ctrl-C
            code = received[-1].exit_code or code  # 0: the command went on after Ctrl-C
    except Signalled as signalled:  # raised while the previous one was being reported
        code = signalled.exit_code
    sys.exit(code)


def program() -> None:
    """Run the command line as the only purpose of this process."""
    try:
        main()
    except SystemExit as end:
        _abandon_threads(int(end.code or 0))
        raise


def _abandon_threads(code: int) -> None:
    """End the process although a plugin's thread goes on, for which Python would wait forever."""
    # Python itself ends the threads of executors
    started = [
        one
        for one in threading.enumerate()
        if one is not threading.main_thread()
        and not (one.daemon or one.name.startswith("ThreadPoolExecutor"))
    ]
    until_s = monotonic() + 2.0  # [s] threads end meanwhile
    for thread in started:
        thread.join(max(0.0, until_s - monotonic()))
    left = [thread.name for thread in started if thread.is_alive()]
    if left:
        from tactile_core.cli.output import flush_stdout, print_message

        print_message(
            f"note: the thread {left[0]!r} of a plugin or library still runs and is abandoned; its "
            f"author should end it in close()"
        )
        flush_stdout()
        os._exit(code)


def _run(words: list[str], debug: bool) -> int:
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    try:
        import warnings

        from tactile_core.cli.app import app
        from tactile_core.cli.output import flush_stdout, refuse_impossible

        if not (debug or sys.warnoptions):
            warnings.simplefilter("ignore")
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")
        refuse_impossible(words)
        result = app(words, prog_name="tactile", standalone_mode=False)
        flush_stdout()
        return result if isinstance(result, int) else 0
    except Signalled as signalled:
        return signalled.exit_code
    except BaseException as error:
        from tactile_core.cli.explaining import explain

        return explain(error, debug)
