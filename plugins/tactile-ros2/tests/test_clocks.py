"""When observations are published, and what their stamps are."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from tactile_core.acquisition.free_running import Clock
from tactile_core.quantities import Frame
from tactile_ros2.clocks import Playback

WALL_S = 1_700_000_000.0


class Host:
    """A computer whose time passes only while somebody waits."""

    def __init__(self) -> None:
        self.now_s = 500.0
        self.said: list[str] = []

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds

    def playback(self, is_live: bool = False) -> Playback:
        clock = Clock(lambda: self.now_s, self.sleep)
        return Playback(is_live, self.said.append, clock, lambda: WALL_S + self.now_s)


def frames(times_s: Iterable[float], walls_s: Iterable[float] | None = None) -> list[Frame]:
    times = list(times_s)
    walls = [0.0] * len(times) if walls_s is None else list(walls_s)
    pixels = np.zeros((2, 2, 3), np.uint8)
    return [
        Frame(pixels, ("r", "g", "b"), 0.1, timestamp_s=time_s, wall_time_s=wall_s, sequence=n)
        for n, (time_s, wall_s) in enumerate(zip(times, walls, strict=True))
    ]


def test_a_live_frame_has_the_time_of_its_exposure_and_is_not_held_back() -> None:
    host = Host()
    playback = host.playback(is_live=True)
    stamps = [playback.stamp(one) for one in frames([1.0, 2.0], [WALL_S + 0.25, WALL_S + 1.25])]
    assert stamps == [1_700_000_000_250_000_000, 1_700_000_001_250_000_000]
    assert (host.now_s, host.said) == (500.0, [])


def test_images_without_a_date_are_stamped_with_the_time_at_which_they_are_played() -> None:
    host = Host()
    playback = host.playback()
    first, *others = frames(n / 30 for n in range(60))
    assert playback.stamp(first) * 1e-9 == pytest.approx(WALL_S + 500, abs=1e-6)
    host.sleep(0.8)  # the first takes longer, and is not caught up with
    due = []
    for number, one in enumerate(others):
        stamp_ns = playback.stamp(one)
        due.append(host.now_s)
        assert stamp_ns * 1e-9 == pytest.approx(WALL_S + 500.8 + number / 30, abs=1e-6)
        host.sleep(0.02)  # measuring takes time
    np.testing.assert_allclose(np.diff(due), 1 / 30, atol=1e-9)


def test_a_recording_keeps_its_stamps() -> None:
    host = Host()
    playback = host.playback()
    walls_s = [WALL_S, WALL_S + 0.5, WALL_S + 1.0]
    stamps = [playback.stamp(one) for one in frames([7.0, 7.5, 8.0], walls_s)]
    assert stamps == [1_700_000_000_000_000_000 + n * 500_000_000 for n in range(3)]
    assert host.now_s == 500.5  # between the last two


def test_who_is_too_slow_goes_on_without_a_rush() -> None:
    host = Host()
    playback = host.playback()
    first, second, third, last = frames([0.0, 0.1, 0.2, 0.3])
    playback.stamp(first)
    playback.stamp(second)
    host.sleep(5.0)
    assert playback.stamp(third) * 1e-9 == pytest.approx(WALL_S + 505, abs=1e-6)
    playback.stamp(last)
    assert host.now_s == pytest.approx(505.1)


@pytest.mark.parametrize(("times_s", "words"), [([0, 0, 3600], "3600.0"), ([50, 50, 0], "-50.0")])
def test_a_recording_that_jumps_is_not_waited_for(times_s: list[float], words: str) -> None:
    host = Host()
    playback = host.playback()
    for one in frames(times_s):
        playback.stamp(one)
    assert host.now_s == 500.0
    (note,) = host.said
    assert f"jumps by {words} s at 000002" in note


@pytest.mark.parametrize("jump_s", [-3600.0, 0.5])
def test_a_wall_clock_that_jumps_is_followed_with_a_note(jump_s: float) -> None:
    host = Host()
    playback = host.playback(is_live=True)
    walls = [WALL_S, WALL_S + 0.1 + jump_s, WALL_S + 0.2 + jump_s]
    stamps = [playback.stamp(one) for one in frames([1.0, 1.1, 1.2], walls)]
    assert stamps[2] * 1e-9 == pytest.approx(walls[2], abs=1e-6)
    (note,) = host.said
    assert f"the clock jumped by {jump_s:+.3f} s at 000001" in note


def test_a_clock_that_is_corrected_slowly_is_not_mentioned() -> None:
    host = Host()
    playback = host.playback(is_live=True)
    for one in frames([1.0, 1.1], [WALL_S, WALL_S + 0.105]):
        playback.stamp(one)
    assert host.said == []


def test_a_live_frame_without_a_date_has_the_time_of_its_arrival() -> None:
    playback = Host().playback(is_live=True)
    (one,) = frames([1.0])
    assert playback.stamp(one) * 1e-9 == pytest.approx(WALL_S + 500, abs=1e-6)
