"""The contact mask covers the contact area, and is empty when nothing touches."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core import load_profile
from tactile_core.algorithms.contact import contact_mask
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.errors import InputError
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter

Array = NDArray[Any]
Bool = NDArray[np.bool_]


def grid(shape: tuple[int, int], mm_per_px: float) -> tuple[Array, Array]:
    y, x = np.mgrid[: shape[0], : shape[1]] * mm_per_px
    return x - x.mean(), y - y.mean()


def hertz(x: Array, y: Array, radius_mm: float, depth_mm: float) -> tuple[Array, float]:
    """Surface of a half-space under a ball (Johnson 1985, eq. 3.41–42), and its contact radius."""
    a = np.sqrt(radius_mm * depth_mm)
    r = np.maximum(np.hypot(x, y), 1e-9)
    inside = depth_mm - r**2 / (2 * radius_mm)
    ratio = np.minimum(a / r, 1)
    outside = ((2 - 1 / ratio**2) * np.arcsin(ratio) + np.sqrt(1 - ratio**2) / ratio) * depth_mm
    return np.where(r < a, inside, outside / np.pi), float(a)


def punch(x: Array, y: Array, radius_mm: float, depth_mm: float) -> Array:
    """Height of a soft layer under a flat-ended cylinder."""
    return depth_mm * np.exp(-np.maximum(np.hypot(x, y) - radius_mm, 0) / 0.2)


def smooth_noise(shape: tuple[int, int], sigma_mm: float, seed: int, width_px: float) -> Array:
    grain = np.random.default_rng(seed).standard_normal(shape)
    noise = np.asarray(cv2.GaussianBlur(grain, (0, 0), width_px))
    return np.asarray(sigma_mm * noise / noise.std())


def overlap(mask: Bool, truth: Bool) -> float:
    return float((mask & truth).sum() / (mask | truth).sum())


@settings(max_examples=25, deadline=None)
@given(st.floats(1.5, 4), st.floats(0.15, 0.8), st.integers(0, 2**32 - 1))
def test_a_ball_on_a_half_space_is_masked_to_its_border(
    radius_mm: float, depth_mm: float, seed: int
) -> None:
    x, y = grid((240, 320), 0.06)
    height, a = hertz(x, y, radius_mm, depth_mm)
    height += smooth_noise(height.shape, 0.004, seed, 3)
    mask = contact_mask(height.astype(np.float32), mm_per_px=0.06)
    assert overlap(mask, np.hypot(x, y) < a) > 0.75


@pytest.mark.parametrize(("diameter_mm", "depth_mm"), [(4, 0.15), (8, 0.3), (12, 0.5), (20, 0.5)])
def test_a_ball_on_a_bonded_layer_is_masked_to_its_border_however_much_of_it_touches(
    diameter_mm: float, depth_mm: float
) -> None:
    surface = GelSurface(load_profile("hex_fingertip", sim=True))
    surface.indent_with(make_indenter("sphere", diameter_mm=diameter_mm))
    surface.press(depth_mm=depth_mm)
    truth = surface.truth()
    mask = contact_mask(truth.height_mm, mm_per_px=truth.mm_per_px)
    assert overlap(mask, truth.contact) > 0.85
    assert mask.sum() == pytest.approx(truth.contact.sum(), rel=0.15)


@pytest.mark.parametrize("shape", [(480, 640), (239, 317), (120, 160)])
def test_a_flat_end_is_masked_to_its_edge_at_every_size(shape: tuple[int, int]) -> None:
    mm_per_px = 14 / shape[0]
    x, y = grid(shape, mm_per_px)
    mask = contact_mask(punch(x, y, 3, 0.3).astype(np.float32), mm_per_px=mm_per_px)
    assert mask.shape == shape
    assert mask.dtype == bool
    assert overlap(mask, np.hypot(x, y) < 3 + 0.1) > 0.94


def test_a_contact_on_two_fifths_of_the_image_is_masked() -> None:
    x, y = grid((240, 320), 0.06)
    height = punch(x + 3, y, 5.0, 0.5)
    mask = contact_mask(height.astype(np.float32), mm_per_px=0.06)
    assert overlap(mask, np.hypot(x + 3, y) < 5.1) > 0.95


def test_the_bulge_next_to_a_wide_contact_is_no_noise() -> None:
    x, y = grid((120, 160), 0.1)
    outside_mm = np.maximum(np.hypot(x, y) - 4.4, 0)
    bulge = 0.035 * np.exp(-outside_mm / 3) * (outside_mm > 0)
    mask = contact_mask((punch(x, y, 4.0, 0.1) - bulge).astype(np.float32), mm_per_px=0.1)
    assert overlap(mask, np.hypot(x, y) < 4.1) > 0.94


def test_a_contact_truncated_by_the_image_border_is_masked_up_to_it() -> None:
    x, y = grid((240, 320), 0.06)
    height = punch(x - 9, y - 6.5, 2, 0.5)
    mask = contact_mask(height.astype(np.float32), mm_per_px=0.06)
    assert overlap(mask, np.hypot(x - 9, y - 6.5) < 2.1) > 0.9
    assert mask[-1, -1]


def test_two_contacts_of_different_depth_are_both_masked() -> None:
    x, y = grid((240, 320), 0.06)
    height = punch(x - 4, y, 1.5, 1.0) + punch(x + 4, y, 1.5, 0.2)
    mask = contact_mask(height.astype(np.float32), mm_per_px=0.06)
    truth = (np.hypot(x - 4, y) < 1.6) | (np.hypot(x + 4, y) < 1.6)
    assert overlap(mask, truth) > 0.9


def ball(x_mm: float, y_mm: float, diameter_mm: float, depth_mm: float) -> NDArray[np.float32]:
    """Height map of a ball pressed into the gel, 0.1 mm per pixel."""
    press = BallPress((10 * x_mm, 10 * y_mm), diameter_mm, depth_mm)
    return press.height_mm((120, 160), 0.1).astype(np.float32)


def test_each_contact_is_masked_independently() -> None:
    deep, shallow = ball(4.5, 6.0, 4.0, 0.5), ball(12.0, 6.0, 4.0, 0.12)
    alone = [contact_mask(height, mm_per_px=0.1) for height in (deep, shallow)]
    assert all(mask.any() for mask in alone)
    both = contact_mask(np.maximum(deep, shallow), mm_per_px=0.1)
    np.testing.assert_array_equal(both, alone[0] | alone[1])


@pytest.mark.parametrize("turned", [np.fliplr, np.flipud, np.transpose])
def test_the_mask_is_mirrored_and_rotated_with_the_height_map(turned: Callable[[Any], Any]) -> None:
    # large enough to be reduced first
    small = ball(5.3, 4.1, 4.0, 0.4) + ball(11.9, 7.4, 3.0, 0.5)
    height = cv2.resize(small, None, fx=3, fy=3, interpolation=cv2.INTER_CUBIC)
    mask = contact_mask(height, mm_per_px=0.1 / 3)
    again = contact_mask(np.ascontiguousarray(turned(height)), mm_per_px=0.1 / 3)
    np.testing.assert_array_equal(again, turned(mask))


def test_a_contact_of_a_fifth_of_a_square_millimetre_is_found_in_a_large_image() -> None:
    press = BallPress((320, 240), 0.6, 0.1)
    height = press.height_mm((480, 640), 0.02).astype(np.float32)
    mask = contact_mask(height, mm_per_px=0.02)
    assert mask.sum() * 0.02**2 == pytest.approx(np.pi * press.contact_radius_mm**2, rel=0.35)
    assert not contact_mask(height, mm_per_px=0.02, min_area_mm2=0.5).any()


def test_a_faint_region_next_to_a_contact_is_missed_in_noise() -> None:
    y, x = np.mgrid[:120, :160]
    noise = 0.03 * np.sin(2 * np.pi * x / 63) * np.sin(2 * np.pi * y / 57)
    faint = ball(12.5, 6.2, 1.5, 0.02)
    assert faint.max() == pytest.approx(0.073, abs=0.001)
    for level, found in ((0.0, True), (1.0, False)):
        height = ball(4.5, 6.0, 4.0, 0.25) + faint + level * noise
        mask = contact_mask(height.astype(np.float32), mm_per_px=0.1)
        assert mask[60, 45]
        assert mask[62, 125] == found


def test_the_contact_radius_of_a_ball_is_within_five_per_cent() -> None:
    x, y = grid((240, 320), 0.06)
    ratios = []
    for radius_mm, depth_mm in ((4, 0.2), (6, 0.3), (5, 0.15)):
        height, a = hertz(x, y, radius_mm, depth_mm)
        mask = contact_mask(height.astype(np.float32), mm_per_px=0.06)
        ratios.append(np.sqrt(mask.sum() * 0.06**2 / np.pi) / a)
    assert np.mean(ratios) == pytest.approx(1, abs=0.05)


@pytest.mark.headline
def test_an_undeformed_gel_with_drift_rarely_has_a_contact() -> None:
    rng = np.random.default_rng(0)
    seen = []
    for seed in range(300):
        sigma_mm, width_px = rng.uniform(0, 0.2), rng.uniform(8, 60)
        height = smooth_noise((240, 320), sigma_mm * width_px / 60, seed, width_px)
        seen.append(contact_mask(height.astype(np.float32), mm_per_px=0.06).any())
    assert np.mean(seen) <= 0.03


def test_a_flat_map_has_no_contact() -> None:
    assert not contact_mask(np.zeros((48, 64), np.float32), mm_per_px=0.1).any()


def test_specks_are_left_out() -> None:
    x, y = grid((240, 320), 0.06)
    height = punch(x, y, 2, 0.5)
    height[10:13, 10:13] = 1
    mask = contact_mask(height.astype(np.float32), mm_per_px=0.06)
    assert not mask[:30, :30].any()
    assert mask.any()


def test_a_region_below_the_least_indentation_is_no_contact() -> None:
    x, y = grid((240, 320), 0.06)
    height = punch(x, y, 2, 0.05).astype(np.float32)
    assert contact_mask(height, mm_per_px=0.06).any()
    assert not contact_mask(height, mm_per_px=0.06, min_indentation_mm=0.06).any()


def test_a_slope_without_a_flank_is_no_contact() -> None:
    x, y = grid((240, 320), 0.06)
    hill = (0.15 * np.exp(-(x**2 + y**2) / (2 * 1.5**2))).astype(np.float32)
    assert not contact_mask(hill, mm_per_px=0.06).any()
    assert contact_mask(hill, mm_per_px=0.06, min_slope=0.02).any()


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (3, 2)])
def test_tiny_images_are_accepted(shape: tuple[int, int]) -> None:
    height = np.random.default_rng(0).random(shape).astype(np.float32)
    assert contact_mask(height, mm_per_px=0.1).shape == shape


def test_a_height_map_of_another_shape_is_refused() -> None:
    with pytest.raises(InputError, match=r"this one is \(2, 3, 4\)"):
        contact_mask(np.zeros((2, 3, 4), np.float32), mm_per_px=0.1)
