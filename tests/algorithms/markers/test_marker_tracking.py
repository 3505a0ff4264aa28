"""Marker tracking: no swapped identities under large motion, missed and spurious detections."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.soak import share_of

from experiments.sheared_markers import Shear, counted
from tactile_core.algorithms.markers.neighbourhood import shows_contact
from tactile_core.algorithms.markers.tracker import MarkerTracker

PITCH = 30.0
seeds = st.integers(0, 2**32 - 1)


def grid(columns: int = 14, rows: int = 11) -> Any:
    x, y = np.arange(columns), np.arange(rows)
    return PITCH * (1.0 + np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))


def bump(places: Any, reach: float = 3.5) -> Any:
    """(N, 1) Gaussian window, 1 at the centre of the markers."""
    far = np.square(places - places.mean(axis=0)).sum(axis=1, keepdims=True)
    return np.exp(-far / (2 * (reach * PITCH) ** 2))


def thinned(places: Any, rng: np.random.Generator, missing: float = 0.3) -> Any:
    kept = places[rng.random(len(places)) >= missing]
    return rng.permutation(kept + rng.normal(0, 0.2, kept.shape))


def swapped(tracker: MarkerTracker, truth: Any) -> int:
    error = np.hypot(*(tracker.px - truth).T)
    return int((tracker.seen & (error > 0.3 * PITCH)).sum())


@given(seeds)
@settings(max_examples=10)
def test_a_shear_of_two_pitches_swaps_no_marker(seed: int) -> None:
    rng, rest = np.random.default_rng(seed), grid()
    angle, step = rng.uniform(0, 2 * np.pi), rng.uniform(0.1, 0.6)
    along = PITCH * np.array([np.cos(angle), np.sin(angle)])
    tracker = MarkerTracker(rest)
    for pitches in np.arange(0, 2 + step, step).clip(max=2):
        truth = rest + bump(rest) * along * pitches
        tracker.update(thinned(truth, rng))
        assert swapped(tracker, truth) == 0
    assert tracker.seen.mean() > 0.55
    unseen = ~tracker.seen
    assert np.percentile(np.hypot(*(tracker.px - truth)[unseen].T), 90) < 0.2 * PITCH


@given(seeds)
@settings(max_examples=8)
def test_a_turn_of_twenty_degrees_swaps_no_marker(seed: int) -> None:
    rng, rest = np.random.default_rng(seed), grid()
    tracker = MarkerTracker(rest)
    for degrees in np.linspace(0, 20 * rng.choice([-1, 1]), 12):
        angle = np.radians(degrees) * bump(rest, 4.0)[:, 0]
        x, y = (rest - rest.mean(axis=0)).T
        turned = np.stack(
            [np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y], axis=1
        )
        truth = rest.mean(axis=0) + turned
        tracker.update(thinned(truth, rng))
        assert swapped(tracker, truth) == 0


def test_markers_that_leave_the_view_keep_their_identity() -> None:
    rest = grid()
    right = rest[:, 0].max() + PITCH / 2
    tracker = MarkerTracker(rest)
    for pitches in [*np.linspace(0, 1.5, 8), *np.linspace(1.5, 0, 8)]:
        truth = rest + np.array([pitches * PITCH, 0.0])
        # markers that are not in the reference enter the view from the other side
        new = truth[::14] - [PITCH, 0.0]
        shown = np.concatenate([truth, new])
        tracker.update(shown[shown[:, 0] < right])
        assert swapped(tracker, truth) == 0
    assert tracker.seen.all()


def test_markers_are_recovered_after_frames_without_most_of_them() -> None:
    rng, rest = np.random.default_rng(0), grid()
    tracker = MarkerTracker(rest)
    tracker.update(rest)
    for _ in range(3):
        tracker.update(rest[rng.permutation(len(rest))[:6]])
        assert tracker.lost
        assert not tracker.seen.any()
    truth = rest + bump(rest) * [0.4 * PITCH, 0.0]
    tracker.update(thinned(truth, rng))
    assert not tracker.lost
    assert tracker.seen.mean() > 0.5
    assert swapped(tracker, truth) == 0


def test_a_frame_without_any_detection_loses_all_markers_until_they_are_seen_again() -> None:
    tracker = MarkerTracker(grid())
    tracker.update(grid())
    tracker.update(np.zeros((0, 2)))
    assert not tracker.seen.any()
    tracker.update(grid())
    assert tracker.seen.all()
    assert swapped(tracker, grid()) == 0


def test_a_release_within_one_frame_swaps_no_marker() -> None:
    rest = grid()
    tracker = MarkerTracker(rest)
    for pitches in np.linspace(0, 1.6, 9):
        tracker.update(rest + bump(rest) * [pitches * PITCH, 0.0])
    tracker.update(rest)
    tracker.update(rest)
    assert swapped(tracker, rest) == 0
    assert tracker.seen.mean() > 0.9


def test_a_displaced_first_frame_is_reported() -> None:
    rest = grid()
    undeformed, sheared = MarkerTracker(rest), MarkerTracker(rest)
    undeformed.update(rest + np.random.default_rng(0).normal(0, 0.3, rest.shape))
    sheared.update(rest + bump(rest) * [0.3 * PITCH, 0.0])
    assert undeformed.began_displaced is False
    assert sheared.began_displaced is True
    assert swapped(sheared, rest + bump(rest) * [0.3 * PITCH, 0.0]) == 0


def sheared(pitches: float, angle: float = 0.0) -> float:
    """Shear a contact by so many pitches a frame; return what the tracker says of its worst."""
    rest, tracker = grid(), MarkerTracker(grid())
    along = PITCH * np.array([np.cos(angle), np.sin(angle)])
    worst = 0.0
    for frame in range(4):
        tracker.update(rest + bump(rest, 2.0) * along * pitches * frame)
        worst = max(worst, tracker.outrun_pitches)
    return worst


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_markers_that_move_too_far_between_frames_are_noticed(angle: float) -> None:
    assert [sheared(pitches, angle) for pitches in (0.1, 0.2, 0.3)] == [0, 0, 0]
    assert all(sheared(pitches, angle) > 0.15 for pitches in (0.6, 0.7, 0.8, 0.9, 1.0))


def test_a_jump_of_more_than_half_a_pitch_is_noticed_until_all_are_found_again() -> None:
    rest, tracker = grid(), MarkerTracker(grid())
    tracker.update(rest)
    low, high = rest.min() - PITCH / 2, rest.max(axis=0) + PITCH / 2
    moved = rest + np.array([0.57 * PITCH, 0.0])
    seen = moved[((moved > low) & (moved < high)).all(axis=1)]
    tracker.update(seen)
    assert tracker.outrun_pitches > 0.4
    tracker.update(seen)
    assert tracker.outrun_pitches > 0.4
    tracker.update(rest)
    tracker.update(rest)
    assert tracker.outrun_pitches == 0


def test_markers_that_an_object_covers_are_not_outrun() -> None:
    rest, tracker = grid(), MarkerTracker(grid())
    tracker.update(rest)
    covered = np.hypot(*(rest - rest.mean(axis=0)).T) < 2 * PITCH
    tracker.update(rest[~covered] + 0.05 * PITCH)
    assert tracker.seen.mean() < 0.95
    assert tracker.outrun_pitches == 0


def test_a_stretched_lattice_shows_a_contact_and_an_irregular_print_does_not() -> None:
    rng, rest = np.random.default_rng(1), grid(16, 14)
    outward = (rest - rest.mean(axis=0)) * bump(rest, 2.0)
    assert shows_contact(rest + 0.4 * outward)
    assert not shows_contact(rest)
    assert not shows_contact(rest + rng.normal(0, 0.05 * PITCH, rest.shape))


def test_fewer_than_four_markers_are_lost() -> None:
    tracker = MarkerTracker(grid()[:3])
    tracker.update(grid()[:3])
    assert tracker.lost
    assert not tracker.seen.any()


def test_a_rigid_step_of_half_a_pitch_loses_no_marker() -> None:
    rng = np.random.default_rng(5)
    rest = grid() + rng.uniform(-2, 2, grid().shape)
    tracker = MarkerTracker(rest)
    tracker.update(rest)
    for moved in (14.0, 28.0, 28.0):
        truth = rest + np.array([moved, 0.0])
        tracker.update(truth)
        assert tracker.seen.mean() > 0.95
        assert np.hypot(*(tracker.px - truth).T)[tracker.seen].max() < 1


def now_and_in_soak(shear: Shear, name: str) -> list[Any]:
    return [
        pytest.param(shear, 100, id=name),
        pytest.param(shear, share_of(10_000), id=f"{name}, long", marks=pytest.mark.soak),
    ]


@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("shear", "frames"),
    [
        *now_and_in_soak(Shear(1.0, 0.35, spurious=0.05), "one pitch"),
        *now_and_in_soak(Shear(2.0, 0.35, spurious=0.0), "two pitches"),
        pytest.param(
            Shear(2.0, 0.35, spurious=0.0),
            1000,
            id="two pitches, longer",
            marks=pytest.mark.headline,
        ),
        *now_and_in_soak(Shear(2.0, 0.35, spurious=0.02), "two pitches, specks"),
        *now_and_in_soak(Shear(2.0, 0.7, spurious=0.05), "two pitches, quickly"),
    ],
)
def test_virtual_strokes_swap_hardly_any_marker(shear: Shear, frames: int) -> None:
    tally = counted(shear, frames)
    print(tally)
    assert tally.swapped - tally.said <= 5e-5 * tally.seen
    assert tally.swapped <= 5e-4 * tally.seen
    assert tally.specks <= 1.2e-3 * tally.seen
    assert tally.rms_of_right_px < 0.15
    assert tally.recall > 0.94
