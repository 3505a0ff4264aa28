"""The contact area, from the steep ring at its border or from the sheared surface."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.shrinking import steepness
from tactile_core.algorithms.slip.touched import (
    contact_from_motion,
    contact_within_ring,
    light_change,
    mask_squares,
    small_image,
)

SHAPE = (60, 80)
ROWS, COLUMNS = np.mgrid[: SHAPE[0], : SHAPE[1]]
RADIUS = np.hypot(ROWS - 30, COLUMNS - 40)
REST = np.full((*SHAPE, 3), 0.4, np.float32)
NOT_HIDDEN = np.zeros(SHAPE, np.bool_)
SPACING_MM = 0.22


def _overlap(mask: np.ndarray, truth: np.ndarray) -> float:
    return float((mask & truth).sum() / (mask | truth).sum())


@settings(max_examples=20, deadline=None)
@given(st.floats(12, 24), st.floats(0.02, 0.3))
def test_a_flat_object_touches_everything_inside_its_edge(radius: float, depth_mm: float) -> None:
    height = (depth_mm / (1 + np.exp(2 * (RADIUS - radius)))).astype(np.float32)
    mask = contact_within_ring(steepness(height, SPACING_MM, smooth=True), min_steepness=0.01)
    assert _overlap(mask, radius > RADIUS) > 0.8


def test_a_constant_height_error_changes_nothing() -> None:
    height = np.where(RADIUS < 15, 0.1, 0.0).astype(np.float32)
    np.testing.assert_allclose(
        steepness(height - 0.3, SPACING_MM, smooth=True),
        steepness(height, SPACING_MM, smooth=True),
        atol=1e-6,
    )


def test_a_gap_in_the_ring_is_closed() -> None:
    ring = (np.abs(RADIUS - 14) < 2).astype(np.float32)
    whole = contact_within_ring(ring, min_steepness=0.1)
    ring[27:33, 50:] = 0
    assert _overlap(contact_within_ring(ring, min_steepness=0.1), whole) > 0.95


def test_a_contact_that_leaves_the_view_at_both_ends_is_joined() -> None:
    flanks = (np.abs(np.abs(ROWS - 30) - 12) < 2).astype(np.float32)
    mask = contact_within_ring(flanks, min_steepness=0.1)
    assert _overlap(mask, np.abs(ROWS - 30) < 12) > 0.9


def test_two_contacts_within_the_view_are_not_joined() -> None:
    apart = np.minimum(np.hypot(ROWS - 30, COLUMNS - 20), np.hypot(ROWS - 30, COLUMNS - 60))
    mask = contact_within_ring((np.abs(apart - 10) < 2).astype(np.float32), min_steepness=0.1)
    assert mask[30, 20]
    assert mask[30, 60]
    assert not mask[:, 40].any()


def test_neither_noise_nor_moved_markers_are_a_contact() -> None:
    rng = np.random.default_rng(1)
    now = REST + rng.normal(0, 0.005, REST.shape).astype(np.float32)
    now[5::10, 5::10] -= 0.3
    now[5::10, 6::10] += 0.3
    markers = np.stack(np.meshgrid(np.arange(5, 80, 10), np.arange(5, 60, 10)), -1).reshape(-1, 2)
    hidden = mask_squares(markers, 1.0, SHAPE)
    assert not contact_within_ring(light_change(now, REST, hidden), min_steepness=0.02).any()


def test_hidden_markers_do_not_break_the_ring() -> None:
    change = 0.1 * (np.abs(RADIUS - 14) < 1.5)[..., None].astype(np.float32)
    markers = np.stack(np.meshgrid(np.arange(2, 80, 5), np.arange(2, 60, 5)), -1).reshape(-1, 2)
    hidden = mask_squares(markers, 1.0, SHAPE)
    seen = light_change(REST + change, REST, NOT_HIDDEN)
    between = light_change(REST + change, REST, hidden)
    assert (
        _overlap(
            contact_within_ring(between, min_steepness=0.02),
            contact_within_ring(seen, min_steepness=0.02),
        )
        > 0.85
    )


def test_points_outside_the_view_cover_nothing() -> None:
    assert not mask_squares(np.array([[-4.0, 3.0], [90.0, 3.0], [3.0, 66.0]]), 1.0, SHAPE).any()
    assert mask_squares(np.array([[3.0, 4.0]]), 1.0, SHAPE).sum() == pytest.approx(9)


def test_the_gel_that_is_sheared_furthest_is_in_contact() -> None:
    moved = np.where(RADIUS < 15, 0.2, 0.05 * np.exp(-RADIUS / 20)).astype(np.float32)
    np.testing.assert_array_equal(contact_from_motion(moved), RADIUS < 15)
    assert not contact_from_motion(0.05 * moved).any()


def test_a_small_image_is_relative_to_the_full_scale() -> None:
    small = small_image(np.full((480, 640, 3), 51, np.uint8), (80, 60), 255.0)
    assert small.shape == (*SHAPE, 3)
    np.testing.assert_allclose(small, 0.2)


def test_where_two_parts_overlap_is_contact_too() -> None:
    steep = np.zeros((80, 100), np.float32)
    steep[10:70, 15:18] = steep[67:70, 15:85] = 1
    steep[15:58, 58:61] = steep[15:18, 30:61] = 1
    assert contact_within_ring(steep, min_steepness=0.1)[50, 56]
