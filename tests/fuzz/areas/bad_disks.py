"""Full, broken and read-only disks, from the first file operation to the last."""

from __future__ import annotations

import errno
from random import Random

from fuzz import recipes
from fuzz.attempt import Attempt
from fuzz.faults import Fault
from fuzz.sandbox import Sandbox

_NUMBERS = (errno.ENOSPC, errno.ENOSPC, errno.EIO, errno.EROFS, errno.EACCES, errno.EDQUOT)
_AGAIN = [*recipes.CALIBRATE[:-3], "--out", "bundle"]
"""Calibrates the unit again, into the folder of its existing bundle."""


def failing(box: Sandbox, rng: Random) -> Attempt:
    """Return a command with a file operation that fails, once or permanently."""
    words = list(rng.choice((*recipes.WRITING, *recipes.RECORDING, _AGAIN, _AGAIN)))
    reading = rng.random() < 0.2
    at = rng.randrange(12) if reading else rng.randrange(10)
    fault = Fault(rng.choice(_NUMBERS), at, reading, lasting=rng.random() < 0.7)
    if not reading and rng.random() < 0.35:
        fault = Fault(limit_bytes=round(100_000 ** rng.uniform(0, 1.1)) - 1)
    ours = (box.work / "bundle",) if words == _AGAIN else ()
    # a file that cannot be read is a mistake of the user or a fault of the disk
    return Attempt(words, fault=fault, ours=ours, codes=frozenset({0, 1, 2} if reading else {0, 1}))
