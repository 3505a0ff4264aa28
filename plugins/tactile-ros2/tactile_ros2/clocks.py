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

    The stamp is the time of exposure since 1970. A recording without one, like images in a folder,
    and a virtual sensor have the time at which they are played.

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
        # timestamp of one observation, and the host's monotonic and wall-clock time when it is due
        self._anchor = (0.0, float("-inf"), 0.0)

    def stamp(self, frame: Frame) -> int:
        """Wait until an observation is due, and return its stamp in ns."""
        self._report_jump(frame)
        begin_s, began_s, wall_s = self._anchor
        if self._is_live:
            return stamp_of(frame)
        now_s = self._clock.now()
        since_s = frame.timestamp_s - begin_s
        late_s = now_s - (began_s + since_s)
        if not -_LONGEST_PAUSE_S <= late_s <= _LARGEST_DELAY_S or since_s < 0:
            self._anchor = (frame.timestamp_s, now_s, self._wall())
            since_s, wall_s = 0.0, self._anchor[2]
        elif late_s < 0:
            self._clock.sleep(-late_s)
        return stamp_of(frame) if frame.wall_time_s else round((wall_s + since_s) * 1e9)

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
