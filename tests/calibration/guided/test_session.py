"""Guided calibration, played by a virtual hand with noise that presses badly now and then."""

from __future__ import annotations

import re
from collections.abc import Iterator
from concurrent.futures import Future
from typing import Any

import numpy as np
import pytest

from benchmarks.guided_calibration import Played, play
from experiments.virtual_hand import VirtualHand
from tactile_core.acquisition.acquisition import average
from tactile_core.calibration.guided import session as guided_session
from tactile_core.calibration.guided.background import AtOnce
from tactile_core.calibration.guided.examination import Verdict
from tactile_core.calibration.guided.session import GuidedCalibration
from tactile_core.errors import CalibrationError, InputError
from tactile_core.quantities import Frame

SMALL = {
    "image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.09},
    "calibration": {"use": "core.polynomial"},
}


class Session:
    """A short session on a small rig, with more bad presses than usual."""

    def __init__(self) -> None:
        self.events: list[tuple[str, dict[str, Any]]] = []
        self.hand = VirtualHand("desktop_three_colour", 200, SMALL, bad_share=0.4)
        self.reference = average(list(self.hand.idle(5)))
        self.guided = GuidedCalibration(
            self.hand.profile,
            self.reference,
            2 * self.hand.ball_mm,
            note=lambda name, values: self.events.append((name, dict(values))),
            at_once=True,
        )
        self.played: Played = play(self.hand, self.guided, most=9)


@pytest.fixture(scope="module")
def session() -> Iterator[Session]:
    return Session()


def test_good_presses_are_kept_and_bad_ones_are_not(session: Session) -> None:
    assert session.played.bad_refused >= 2
    assert session.played.wrong == ()


def test_the_kept_presses_are_calibrated_as_from_files(session: Session) -> None:
    result = session.guided.finish(scored=False)
    assert [press.file for press in result.presses] == list(session.guided.presses)
    assert all(press.used for press in result.presses)
    assert result.bundle.manifest.presses_used == session.played.good_kept


def test_the_next_frames_say_what_to_do(session: Session) -> None:
    hand, guided = session.hand, session.guided
    (guidance,) = [guided.feed(frame) for frame in hand.idle(1)]
    assert guidance.state == "press"
    assert guidance.target_px is not None
    assert guidance.kept == len(guided.presses)
    assert 0 < guidance.coverage.mean() < 1
    seen = [guided.feed(frame).state for frame in hand.press(guidance.target_px, 0.6)]
    assert set(seen) <= {"press", "hold", "lift"}


def test_a_recording_is_given_every_press_that_is_kept(session: Session) -> None:
    named = [values["name"] for name, values in session.events if name.endswith("kept")]
    assert set(session.guided.presses) <= set(named)
    stamps = {values["timestamp_s"] for _, values in session.events}
    assert {frame.timestamp_s for frame in session.guided.presses.values()} <= stamps


def test_without_a_press_there_is_nothing_to_fit(session: Session) -> None:
    hand = session.hand
    empty = GuidedCalibration(hand.profile, session.reference, 2 * hand.ball_mm, at_once=True)
    with pytest.raises(CalibrationError, match="no press was kept"):
        empty.finish()


def test_an_implausible_ball_is_refused(session: Session) -> None:
    with pytest.raises(InputError, match="ball-diameter-mm must be positive"):
        GuidedCalibration(session.hand.profile, session.reference, -1.0, at_once=True)
    with pytest.raises(InputError, match=r"900 mm is nearly flat over a view of 14\.4 mm"):
        GuidedCalibration(session.hand.profile, session.reference, 900.0, at_once=True)


def test_a_killed_process_is_said_in_words_and_the_session_is_not_lost(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    hand = session.hand
    guided = GuidedCalibration(hand.profile, session.reference, 2 * hand.ball_mm, at_once=True)

    def killed(self: AtOnce, name: str, frame: Frame) -> Future[Verdict]:
        future: Future[Verdict] = Future()
        future.set_exception(ChildProcessError("a worker process ended unexpectedly"))
        return future

    monkeypatch.setattr(AtOnce, "examine", killed)
    with pytest.raises(ChildProcessError, match=r"killed.*'tactile calibrate --presses'"):
        play(hand, guided, most=len(hand.attempts) + 4)


def test_presses_that_are_still_examined_count(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who presses faster than presses are examined is not led on for ever."""
    monkeypatch.setattr(guided_session.SESSION, "most_presses", 3)
    hand = VirtualHand("desktop_three_colour", 201, SMALL, bad_share=0.0)
    reference = average(list(hand.idle(5)))
    guided = GuidedCalibration(hand.profile, reference, 2 * hand.ball_mm, at_once=True)
    behind: list[tuple[Future[Verdict], Future[Verdict]]] = []
    at_once = AtOnce.examine

    def late(self: AtOnce, name: str, frame: Frame) -> Future[Verdict]:
        """Give the verdict of a press when the one after it is examined."""
        finish_last()
        behind.append((Future(), at_once(self, name, frame)))
        return behind[-1][0]

    def finish_last() -> None:
        if behind and not behind[-1][0].done():
            behind[-1][0].set_result(behind[-1][1].result())

    monkeypatch.setattr(AtOnce, "examine", late)
    played = play(hand, guided, most=7)
    assert len(behind) == 3
    assert played.good_kept == 2
    finish_last()
    (guidance,) = [guided.feed(frame) for frame in hand.idle(1)]
    assert guidance.done
    assert guidance.kept == 3


def test_a_killed_fit_is_said_in_words(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    def killed(self: AtOnce, *given: Any, **options: Any) -> Any:
        raise ChildProcessError("a worker process ended unexpectedly")

    monkeypatch.setattr(AtOnce, "run", killed)
    with pytest.raises(ChildProcessError, match=r"killed.*'tactile calibrate --presses'"):
        session.guided.finish()


def test_a_light_that_has_changed_is_reported(session: Session) -> None:
    hand = session.hand
    brighter = average(list(hand.idle(3)))
    dark = type(brighter)(**{**vars(brighter), "pixels": brighter.pixels * np.float32(0.8)})
    guided = GuidedCalibration(hand.profile, dark, 2 * hand.ball_mm, at_once=True)
    (guidance,) = [guided.feed(frame) for frame in hand.idle(1)]
    assert guidance.warning is not None
    assert re.search("the light has changed by 2[3-6]%", guidance.warning)
