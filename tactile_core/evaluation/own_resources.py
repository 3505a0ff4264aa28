"""Memory and threads of this process."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def peak_memory_mib() -> float | None:
    """Peak resident memory of this process, including code and libraries, MiB.

    None on systems with neither ``/proc`` nor :mod:`resource`.
    """
    try:
        # ru_maxrss would include the parent's memory: Linux passes it on to a new process
        status = Path("/proc/self/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) / 1024
    except (OSError, IndexError):
        pass
    try:
        import resource
    except ImportError:
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20


@contextmanager
def one_thread() -> Iterator[None]:
    """Restrict OpenCV to one thread inside the block, as on a robot with other tasks."""
    import cv2

    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)
