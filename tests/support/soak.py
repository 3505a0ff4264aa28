"""How much of the long tests to run, and what a process holds."""

from __future__ import annotations

import ctypes
import gc
import os
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

SHARE = float(os.environ.get("TACTILE_SOAK", "1"))
"""Share of the cycles and minutes that is run; CI sets a tenth."""

_STATUS, _FILES = Path("/proc/self/statm"), Path("/proc/self/fd")


def share_of(whole: int) -> int:
    """Return how many of the cycles, seconds or faults to run."""
    return max(4, round(SHARE * whole))


@dataclass(frozen=True)
class Held:
    """What this process holds.

    Attributes
    ----------
    threads, files : int
    mib : float
        Resident memory, once what is free has been returned to the system.
    """

    threads: int
    files: int
    mib: float

    @classmethod
    def now(cls) -> Held:
        gc.collect()
        ctypes.CDLL(None).malloc_trim(0)
        pages = int(_STATUS.read_text().split()[1])
        resident = pages * os.sysconf("SC_PAGE_SIZE") / 2**20
        return cls(threading.active_count(), len(list(_FILES.iterdir())), resident)

    def less(self, before: Held) -> Held:
        """Return what is held more than before."""
        return Held(self.threads - before.threads, self.files - before.files, self.mib - before.mib)

    def __str__(self) -> str:
        return f"{self.threads:+} threads, {self.files:+} files, {self.mib:+.2f} MiB"


def growth(samples: Sequence[Held]) -> Held:
    """Return how much more was held in the second half of the samples than in the first.

    Each half counts by its least sample: what comes and goes is no leak. A leak appears with
    about half of its size.
    """
    middle = len(samples) // 2
    halves = [
        Held(*(min(getattr(one, name) for one in half) for name in ("threads", "files", "mib")))
        for half in (samples[:middle], samples[middle:])
    ]
    return halves[1].less(halves[0])
