"""The command ``tactile``: data to stdout, words to stderr, one sentence when it fails.

May import every room but testing.
"""

from __future__ import annotations

import os
import sys

from tactile_core.cli.signals import Signalled, signals_raised

_ENVIRONMENT = {
    # Matrices here are small: more threads only wait for each other, several times as long when
    # anything else runs. Only the first import of numpy reads this.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # What OpenCV and FFmpeg would print beside the one sentence that says what is wrong.
    "OPENCV_LOG_LEVEL": "OFF",
    "OPENCV_FFMPEG_LOGLEVEL": "-8",
}


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit.

    Exit codes: 0 done; 2 something that the user gave is unusable; 1 it failed while working;
    128 and the signal's number where one ended it.
    """
    words = sys.argv[1:] if arguments is None else arguments
    try:
        with signals_raised() as came:
            code = _run([word for word in words if word != "--debug"], "--debug" in words)
        if came:  # the library that reads the command line takes each of them for Ctrl-C
            code = came[-1].exit_code
    except Signalled as signalled:  # while the last one was being explained
        code = signalled.exit_code
    sys.exit(code)


def _run(words: list[str], debug: bool) -> int:
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    try:
        import warnings

        from tactile_core.cli.app import app
        from tactile_core.cli.output import let_go_of_stdout
        from tactile_core.cli.paths import refuse_impossible

        if not (debug or sys.warnoptions):
            warnings.simplefilter("ignore")
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")
        refuse_impossible(words)
        result = app(words, prog_name="tactile", standalone_mode=False)
        let_go_of_stdout()
        return result if isinstance(result, int) else 0
    except Signalled as signalled:
        return signalled.exit_code
    except BaseException as error:
        from tactile_core.cli.explaining import explain

        return explain(error, debug)
