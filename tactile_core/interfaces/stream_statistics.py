"""Statistics of a stream of images: its rate, and images that are missing or useless."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True)
class StreamStatistics:
    """What has arrived from a camera since it was opened.

    Attributes
    ----------
    received : int
        Whole images with a time of their own, including those that were dropped.
    dropped : int
        Images that nobody read, because newer ones arrived first.
    repeated : int
        Images that equal the one before in every byte, or have its timestamp. An image with the
        same timestamp is the same exposure and is left out; equal bytes alone can be a dark scene.
    torn : int
        Images that arrived incomplete or could not be decoded; they are left out.
    rate_hz : float
        Measured rate of the images of the last two seconds; 0 if there are fewer than two.
    """

    received: int = 0
    dropped: int = 0
    repeated: int = 0
    torn: int = 0
    rate_hz: float = 0.0


class RateMeter:
    """Measures the rate of events from their times.

    Parameters
    ----------
    window_s : float
        Only events of this last time count, so that a stall is visible soon.
    """

    def __init__(self, window_s: float) -> None:
        self._window_s = window_s
        self._times_s: deque[float] = deque()

    def add(self, time_s: float) -> None:
        """Record an event."""
        self._times_s.append(time_s)
        self._forget(time_s)

    def rate_hz(self, now_s: float) -> float:
        """Return the mean rate of the events within the window; 0 for fewer than two."""
        self._forget(now_s)
        if len(self._times_s) < 2 or self._times_s[-1] <= self._times_s[0]:
            return 0.0
        return (len(self._times_s) - 1) / (self._times_s[-1] - self._times_s[0])

    def _forget(self, now_s: float) -> None:
        while self._times_s and self._times_s[0] < now_s - self._window_s:
            self._times_s.popleft()
