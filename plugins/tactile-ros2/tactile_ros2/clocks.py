"""When an observation is published, and the time that its messages are stamped with."""

from __future__ import annotations

import time
from collections.abc import Callable

from tactile_core.acquisition.free_running import HOST, Clock
from tactile_core.quantities import Frame
from tactile_rosbag.names import stamp_of

# [s] Longest pause of a recording that is waited for, and largest delay that is caught up with
_LONGEST_PAUSE_S = 10.0
_LARGEST_DELAY_S = 1.0
# [s] Smallest jump of a clock that is reported: NTP corrects less than 0.128 s without a jump
_SMALLEST_JUMP_S = 0.128


class Playback:
    """Plays observations that are not live in their own time, and stamps all observations.

    The stamp is the time of exposure since 1970. What has no date, as images in a folder or of a
    virtual sensor, has the time at which it is played.

    Parameters
    ----------
    is_live : bool
        Whether a device sets the pace.
    say : callable
        Receives a sentence about a clock that jumps.
    clock : Clock
        The host's, which never goes back.
    wall : callable
        Returns the host's time since 1970, s.
    """

    def __init__(
        self,
        is_live: bool,
        say: Callable[[str], None],
        clock: Clock = HOST,
        wall: Callable[[], float] = time.time,
    ) -> None:
        self._is_live, self._say = is_live, say
        self._clock, self._wall = clock, wall
        self._before: Frame | None = None
        # timestamp of an observation, and the host's two clocks when it was due
        self._anchor: tuple[float, float, float] | None = None

    def stamp(self, frame: Frame) -> int:
        """Wait until an observation is due, and return its stamp in ns."""
        is_first = self._before is None
        self._report_jump(frame)
        played_s = self._wall() if self._is_live else self._play(frame)
        if is_first:
            self._anchor = None  # much is imported for the first reading: the second sets the pace
        return stamp_of(frame) if frame.wall_time_s else round(played_s * 1e9)

    def _play(self, frame: Frame) -> float:
        """Wait until an observation is due, and return that time since 1970, s."""
        now_s = self._clock.now()
        begin_s, began_s, wall_s = self._anchor or (frame.timestamp_s, now_s, self._wall())
        since_s = frame.timestamp_s - begin_s
        early_s = began_s + since_s - now_s
        if since_s < 0 or not -_LARGEST_DELAY_S <= early_s <= _LONGEST_PAUSE_S:
            begin_s, began_s, wall_s = frame.timestamp_s, now_s, self._wall()
            since_s = early_s = 0.0
        self._anchor = begin_s, began_s, wall_s
        self._clock.sleep(max(0.0, early_s))
        return wall_s + since_s

    def _report_jump(self, frame: Frame) -> None:
        before, self._before = self._before, frame
        if before is None:
            return
        step_s = frame.timestamp_s - before.timestamp_s
        if not self._is_live and not 0 <= step_s <= _LONGEST_PAUSE_S:
            self._say(
                f"the recording jumps by {step_s:.1f} s at {frame.name} and goes on without a "
                f"pause; record again without a break if what listens needs all of it"
            )
        elif frame.wall_time_s and before.wall_time_s:
            jump_s = frame.wall_time_s - before.wall_time_s - step_s
            if abs(jump_s) > _SMALLEST_JUMP_S:
                self._say(
                    f"the clock jumped by {jump_s:+.3f} s at {frame.name}, and the stamps with it; "
                    f"restart what compares stamps, such as tf, and synchronise the clock first"
                )
