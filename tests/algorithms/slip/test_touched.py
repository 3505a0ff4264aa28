"""The contact on a sensor that measures no height."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.slip.touched import small_image, touched_by_image, touched_by_motion

SHAPE = (60, 80)
ROWS, COLUMNS = np.mgrid[: SHAPE[0], : SHAPE[1]]
RADIUS = np.hypot(ROWS - 30, COLUMNS - 40)
REST = np.full((*SHAPE, 3), 0.4, np.float32)


def test_a_ring_of_changed_light_is_a_contact_with_what_it_encloses() -> None:
    now = REST + 0.2 * (np.abs(RADIUS - 14) < 3)[..., None].astype(np.float32)
    mask, strength = touched_by_image(now, REST)
    assert mask[30, 40]
    assert not mask[RADIUS > 20].any()
    assert strength > 0


def test_neither_noise_nor_marks_that_moved_are_a_contact() -> None:
    rng = np.random.default_rng(1)
    now = REST + rng.normal(0, 0.01, REST.shape).astype(np.float32)
    now[5::10, 5::10] -= 0.3
    now[5::10, 6::10] += 0.3
    mask, _ = touched_by_image(now, REST, noise=0.01)
    assert not mask.any()


def test_a_stronger_press_has_a_larger_strength() -> None:
    ring = (np.abs(RADIUS - 14) < 3)[..., None].astype(np.float32)
    strengths = [touched_by_image(REST + s * ring, REST)[1] for s in (0.1, 0.2, 0.3)]
    assert strengths == sorted(strengths)


def test_skin_that_is_dragged_along_is_in_contact_and_the_rest_is_not() -> None:
    moved = np.where(RADIUS < 15, 0.2, 0.05 * np.exp(-RADIUS / 20)).astype(np.float32)
    np.testing.assert_array_equal(touched_by_motion(moved), RADIUS < 15)
    assert not touched_by_motion(0.05 * moved).any()


def test_an_image_becomes_shares_of_the_full_scale() -> None:
    small = small_image(np.full((480, 640, 3), 51, np.uint8), (80, 60), 255.0)
    assert small.shape == (*SHAPE, 3)
    np.testing.assert_allclose(small, 0.2)
