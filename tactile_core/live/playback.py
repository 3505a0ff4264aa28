"""Plays a recording at its own speed: pause, step, speed and loop."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any


@dataclass(frozen=True)
class PlaybackState:
    """How a recording is played.

    Attributes
    ----------
    paused, loop : bool
    speed : float
        1 is the recording's own; 0 is as fast as the sensor measures.
    ended : bool
        Whether the last observation was played.
    """

    paused: bool = False
    loop: bool = True
    speed: float = 1.0
    ended: bool = False

    def described(self) -> dict[str, Any]:
        """Return it as JSON-ready values."""
        return dict(vars(self))


class Playback:
    """Decides when the next observation of a recording is due.

    Only the thread that measures uses it.
    """

    def __init__(self) -> None:
        self.state = PlaybackState()
        self._steps = 0
        self._anchor: tuple[float, float] | None = None

    @property
    def waits(self) -> bool:
        """Whether the next observation has to wait for the user."""
        return self.state.ended or (self.state.paused and not self._steps)

    def play(
        self,
        *,
        paused: bool | None = None,
        loop: bool | None = None,
        speed: float | None = None,
        step: bool = False,
    ) -> bool:
        """Change how it is played; return whether it has to be rewound first."""
        given = {"paused": paused, "loop": loop, "speed": speed}
        rewind = self.state.ended and (step or paused is False or loop is True)
        changes: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
        if step:
            changes["paused"], self._steps = True, 1
        self.state = replace(self.state, **changes, ended=self.state.ended and not rewind)
        self._anchor = None
        return rewind

    def end(self) -> bool:
        """Note that the recording has ended; return whether it has to be rewound now."""
        self._anchor = None
        self.state = replace(self.state, ended=not self.state.loop)
        return self.state.loop

    def wait_s(self, timestamp_s: float, now_s: float) -> float:
        """Return how long the observation of this timestamp must still wait, s."""
        if self._steps or not self.state.speed:
            return 0.0
        if self._anchor is None or timestamp_s < self._anchor[0]:
            self._anchor = (timestamp_s, now_s)
        begin_s, began_s = self._anchor
        due_s = began_s + (timestamp_s - begin_s) / self.state.speed
        if due_s < now_s - 1.0:  # too slow for this speed: go on from here, without a rush
            self._anchor = (timestamp_s, now_s)
        return max(0.0, due_s - now_s)

    def played(self) -> None:
        """Note that an observation was shown."""
        self._steps = 0
