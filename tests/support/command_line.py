"""Runs the command ``tactile`` in this process, which saves the time of importing it."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import warnings
from contextlib import redirect_stderr, redirect_stdout
from unittest.mock import patch

from tactile_core.cli import main


def tactile(*words: object) -> subprocess.CompletedProcess[str]:
    """Run the command, with the same results as a separate process."""
    arguments = [os.fspath(word) if isinstance(word, os.PathLike) else str(word) for word in words]
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2))
    with (
        redirect_stdout(out),
        redirect_stderr(err),
        patch.dict(os.environ),
        patch.object(sys, "argv", ["tactile", *arguments]),
        warnings.catch_warnings(),
    ):
        try:
            main()
        except SystemExit as end:
            code = end.code
    assert isinstance(code, int)
    texts = [stream.buffer.getvalue().decode() for stream in (out, err)]  # type: ignore[attr-defined]
    return subprocess.CompletedProcess(arguments, code, *texts)


def refused(*words: object) -> str:
    """Run a command that must refuse its input, and return its message."""
    done = tactile(*words)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    return done.stderr
