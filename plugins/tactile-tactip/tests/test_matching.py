"""Pins keep their identities, in any order, and where some are missing or others are seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.markers.neighbourhood import Neighbourhood
from tactile_core.profiles.loader import load_profile
from tactile_tactip.dome import Plate, pins_at_rest, pressed_pins, seen_px
from tactile_tactip.matching import match_pins

IMAGE = load_profile("tactip").image
REST_PX = seen_px(pins_at_rest(), IMAGE)
AROUND = Neighbourhood.from_places(REST_PX)
PLATES = st.builds(
    Plate,
    st.floats(-1, 3.5),
    st.floats(-30, 30),
    st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)),
)


@given(PLATES, st.integers(0, 1000))
def test_each_pin_is_found_in_any_order_of_the_detections(plate: Plate, seed: int) -> None:
    true_px = seen_px(pressed_pins(plate), IMAGE)
    shuffled = np.random.default_rng(seed).permutation(true_px)
    px, seen = match_pins(AROUND, REST_PX, shuffled)
    assert seen.all()
    assert px == pytest.approx(true_px)


@given(PLATES, st.integers(0, 1000))
def test_missing_pins_and_pieces_of_the_rim_shift_no_other_pin(plate: Plate, seed: int) -> None:
    rng = np.random.default_rng(seed)
    true_px = seen_px(pressed_pins(plate), IMAGE)
    missing = rng.choice(len(true_px), 3, replace=False)
    rim = 127.5 + 122 * np.array([[np.cos(a), np.sin(a)] for a in rng.uniform(0, 6.3, 3)])
    found = np.concatenate([np.delete(true_px, missing, axis=0), rim])
    px, seen = match_pins(AROUND, REST_PX, found)
    assert not seen[missing].any()
    there = np.delete(np.arange(len(true_px)), missing)
    assert seen[there].mean() > 0.97
    assert px[there][seen[there]] == pytest.approx(true_px[there][seen[there]])
    # the neighbours' prediction is nearer than the next pin
    assert np.hypot(*(px - true_px).T).max() < AROUND.pitch_px / 2


def test_a_frame_without_pins_shows_none() -> None:
    px, seen = match_pins(AROUND, REST_PX, np.zeros((0, 2)))
    assert not seen.any()
    assert px == pytest.approx(REST_PX)


def test_all_pins_may_move_by_most_of_a_pitch_together() -> None:
    true_px = REST_PX + np.array([0.8 * AROUND.pitch_px, 0])
    px, seen = match_pins(AROUND, REST_PX, true_px)
    assert seen.all()
    assert px == pytest.approx(true_px)
