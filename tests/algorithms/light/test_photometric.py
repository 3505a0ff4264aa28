import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.light.photometric import (
    around_markers,
    place,
    relative_change,
)
from tactile_core.algorithms.slopes.sampling import Sampling


@given(st.floats(0.2, 2.0))
def test_a_brighter_light_gives_the_same_change_everywhere(gain: float) -> None:
    base = np.linspace(40, 120, 60, dtype=np.float32).reshape(5, 4, 3)
    np.testing.assert_allclose(relative_change(gain * base, base), gain - 1, atol=1e-5)


def test_a_dark_reference_gives_finite_changes() -> None:
    change = relative_change(np.full((1, 1, 3), 20.0), np.zeros((1, 1, 3), np.float32))
    assert np.isfinite(change).all()


def test_noise_of_one_grey_level_in_the_dark_is_no_large_change() -> None:
    dark = np.linspace(0, 20, 21, dtype=np.float32)[:, None]
    noise = relative_change(dark + 1, dark) - relative_change(dark, dark)
    assert noise.max() <= 0.1


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_smoothing_keeps_a_uniform_image_and_its_dtype(dtype: type) -> None:
    flat = np.full((20, 30, 3), 77, dtype)
    smoothed = Sampling.at_every_pixel(flat.shape, None, 2.0).smooth(flat, None)
    assert smoothed.dtype == dtype
    np.testing.assert_allclose(smoothed, 77, atol=1e-3)


@given(st.floats(0.0, 8.0))
def test_smoothing_has_the_requested_standard_deviation(blur_px: float) -> None:
    point = np.zeros((81, 81, 1), np.float32)
    point[40, 40] = 1
    spread = Sampling.at_every_pixel(point.shape, None, blur_px).smooth(point, None)[..., 0].sum(0)
    deviation = np.sqrt((spread * (np.arange(81) - 40) ** 2).sum())
    # the window ends at two and a half standard deviations
    assert abs(deviation - blur_px) < 0.75


def test_any_number_of_channels_is_smoothed_and_filled() -> None:
    marker_mask = np.zeros((40, 50), bool)
    marker_mask[10:16, 10:16] = True
    pixels = np.where(marker_mask[..., None], 5, np.full((40, 50, 6), 90)).astype(np.uint8)
    smoothed = Sampling.at_every_pixel((40, 50), marker_mask, 2.0).smooth(pixels, marker_mask)
    np.testing.assert_allclose(smoothed.astype(int), 90, atol=1)


@pytest.mark.parametrize("radius", [2, 5, 11])
def test_filled_markers_leave_no_trace_on_a_gentle_gradient(radius: int) -> None:
    y, x = np.mgrid[:120, :160]
    surface = np.stack([100 + 0.2 * x, 120 - 0.2 * y, 90 + 0 * x], 2).astype(np.uint8)
    marker_mask = np.zeros((120, 160), bool)
    for cx, cy in ((40, 40), (110, 70), (70, 95)):
        marker_mask |= np.hypot(x - cx, y - cy) <= radius
    printed = np.where(marker_mask[..., None], 10, surface).astype(np.uint8)
    filled = Sampling.at_every_pixel((120, 160), marker_mask, 0.0).smooth(printed, marker_mask)
    assert np.abs(filled.astype(int) - surface).max() <= 4
    np.testing.assert_array_equal(filled[~marker_mask], printed[~marker_mask])


def test_the_neighbourhood_extends_beyond_the_markers() -> None:
    marker_mask = np.zeros((50, 50), bool)
    marker_mask[10:17, 10:17] = marker_mask[30:37, 20:27] = True
    assert around_markers(marker_mask) == 15
    assert around_markers(np.zeros((5, 5), bool)) == around_markers(None) == 0


def test_place_is_zero_at_the_centre_and_in_half_widths() -> None:
    where = place((5, 9))
    np.testing.assert_allclose(where[2, 4], [0, 0], atol=1e-7)
    np.testing.assert_allclose(where[2, 8, 0], 4 / 4.5, rtol=1e-6)
    np.testing.assert_allclose(where[4, 4, 1], 2 / 4.5, rtol=1e-6)
