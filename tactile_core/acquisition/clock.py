"""The clock of the host, in which light and camera meet."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple


class Clock(NamedTuple):
    """A clock that never goes back.

    Attributes
    ----------
    now : callable
        Returns the time, s.
    sleep : callable
        Waits for a time, s.
    """

    now: Callable[[], float]
    sleep: Callable[[float], None]


HOST = Clock(time.monotonic, time.sleep)  # The clock of every camera's timestamps
