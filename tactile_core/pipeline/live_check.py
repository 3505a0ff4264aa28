"""Drops live observations in which an exposure shows another light than its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.errors import SequenceError
from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import Frame


class LIVE_CHECK:
    """When dropping observations ends."""

    # [count] Observations dropped in succession that are an error. Source: chance or a moving gel
    # spoils one or two; five have a cause that remains.
    in_succession = 5


class LiveCheck:
    """Acquires the observations of a live camera whose exposures show their own lights.

    Parameters
    ----------
    acquisition : Acquisition
        Waits longer after each change of light once an observation was dropped.
    """

    def __init__(self, acquisition: Acquisition) -> None:
        self._acquisition = acquisition
        self._dropped: list[str] = []

    def observe(self, verify: Callable[[Frame], None], timeout_s: float) -> Frame | None:
        """Return the next good observation; None if there are no more.

        Raises
        ------
        SequenceError
            Several observations in succession show the wrong light.
        DeviceError
            The camera or the lights failed.
        """
        for _ in range(LIVE_CHECK.in_succession):
            frame = self._acquisition.observe(timeout_s)
            if frame is None:
                return None
            try:
                verify(frame)
            except SequenceError as error:
                last = error
                self._dropped.append(f"{error}; it was dropped")
                self._acquisition.widen_margin()
            else:
                return frame
        raise SequenceError(
            f"{last}; {LIVE_CHECK.in_succession} observations in succession were dropped: check "
            f"the lights, and that 'lights' of the light driver names its outputs as they are wired"
        ) from last

    def noted(self, reading: Reading) -> Reading:
        """Add a warning to a reading for each observation that was dropped since the last one."""
        dropped, self._dropped = tuple(self._dropped), []
        return replace(reading, warnings=(*reading.warnings, *dropped)) if dropped else reading
