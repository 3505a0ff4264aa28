"""When the observations of a recording are due."""

from __future__ import annotations

import pytest

from tactile_live.opening import ShownPlayback


def test_a_recording_plays_at_its_own_speed() -> None:
    playback = ShownPlayback()
    assert playback.wait_s(5.0, now_s=100.0) == 0
    assert playback.wait_s(5.5, now_s=100.2) == pytest.approx(0.3)
    assert playback.wait_s(5.5, now_s=100.6) == 0


@pytest.mark.parametrize(("speed", "wait_s"), [(0.5, 2.0), (2.0, 0.5), (0.0, 0.0)])
def test_it_can_be_slower_and_faster(speed: float, wait_s: float) -> None:
    playback = ShownPlayback()
    playback.play(speed=speed)
    playback.wait_s(0.0, now_s=10.0)
    assert playback.wait_s(1.0, now_s=10.0) == pytest.approx(wait_s)


def test_a_computer_that_is_too_slow_does_not_hurry_afterwards() -> None:
    playback = ShownPlayback()
    playback.wait_s(0.0, now_s=0.0)
    assert playback.wait_s(1.0, now_s=60.0) == 0
    assert playback.wait_s(1.5, now_s=60.1) == pytest.approx(0.4)


def test_a_pause_waits_and_a_step_shows_one_observation() -> None:
    playback = ShownPlayback()
    playback.play(paused=True)
    assert playback.waits
    playback.play(step=True)
    assert not playback.waits
    assert playback.wait_s(99.0, now_s=0.0) == 0
    playback.note_observation()
    assert playback.waits
    assert playback.state.paused


def test_at_the_end_it_begins_again_or_waits() -> None:
    playback = ShownPlayback()
    assert playback.end()
    playback.play(loop=False)
    assert not playback.end()
    assert playback.waits
    assert playback.state.ended
    assert playback.play(paused=False)
    assert not playback.waits


def test_a_loop_may_go_back_in_time() -> None:
    playback = ShownPlayback()
    playback.wait_s(8.0, now_s=0.0)
    assert playback.wait_s(0.0, now_s=0.1) == 0
    assert playback.wait_s(0.5, now_s=0.1) == pytest.approx(0.5)
