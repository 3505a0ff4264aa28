"""Smoothing on a coarse grid gives the same image as at full size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.shrinking import interpolate_cells
from tactile_core.algorithms.slopes.sampling import Sampling


def there_and_back(image, blur_px):
    sampling = Sampling.for_shape(image.shape, None, blur_px)
    (plane,) = sampling.planes(image[..., None], None)
    return interpolate_cells(plane, sampling.step, image.shape)


@given(
    height=st.integers(70, 101),
    width=st.integers(70, 101),
    blur_px=st.floats(0, 6),
)
def test_a_ramp_stays_a_ramp_away_from_the_border(height, width, blur_px):
    rows, columns = np.indices((height, width), np.float32)
    ramp = 0.5 * rows + 2 * columns
    inner = (slice(int(4 * blur_px) + 6, -int(4 * blur_px) - 7),) * 2
    np.testing.assert_allclose(there_and_back(ramp, blur_px)[inner], ramp[inner], atol=1e-2)


@pytest.mark.parametrize("blur_px", [1.5, 1.6, 2.3, 3.0, 4.5])
def test_the_standard_deviation_is_the_requested_one(blur_px):
    spread = []
    for shift in range(8):  # averaged over the positions of a point in a coarse pixel
        point = np.zeros((96, 96), np.float32)
        point[48, 44 + shift] = 1
        seen = there_and_back(point, blur_px)
        across = seen.sum(axis=0) / seen.sum()
        x = np.arange(96) - (44 + shift)
        spread.append(across @ x**2)
    assert np.sqrt(np.mean(spread)) == pytest.approx(blur_px, rel=0.05)


def test_little_smoothing_keeps_every_pixel():
    image = np.random.default_rng(0).normal(size=(31, 41)).astype(np.float32)
    np.testing.assert_array_equal(there_and_back(image, 0.0), image)


def test_the_coarse_grid_is_as_smooth_as_the_full_size():
    noise = np.random.default_rng(0).normal(size=(240, 320)).astype(np.float32)
    full = Sampling.at_every_pixel(noise.shape, None, 2.0).smooth(noise[..., None], None)[..., 0]
    coarse = there_and_back(noise, 2.0)
    assert coarse.std() == pytest.approx(full.std(), rel=0.25)
    assert np.corrcoef(coarse.ravel(), full.ravel())[0, 1] > 0.95


def test_markers_are_filled_before_averaging():
    image = np.full((80, 80, 3), 100, np.uint8)
    marker_mask = np.zeros((80, 80), bool)
    marker_mask[38:43, 38:43] = True
    image[marker_mask] = 0
    sampling = Sampling.for_shape((80, 80), marker_mask, 2.0)
    for plane in sampling.planes(image, marker_mask):
        assert plane.min() >= 99


@pytest.mark.parametrize("blur_px", [0.0, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("shape", [(80, 96), (81, 97)])
def test_all_channels_at_once_give_what_each_gives_by_itself(shape, blur_px):
    image = np.random.default_rng(0).integers(0, 256, (*shape, 3)).astype(np.uint8)
    marker_mask = np.zeros(shape, bool)
    marker_mask[30:40, 50:60] = True
    sampling = Sampling.for_shape(shape, marker_mask, blur_px)
    together = sampling.smooth(image, marker_mask)
    planar = np.ascontiguousarray(image.transpose(2, 0, 1)).transpose(1, 2, 0)
    np.testing.assert_array_equal(sampling.smooth(planar, marker_mask), together)
    np.testing.assert_array_equal(np.dstack(sampling.planes(image, marker_mask)), together)


def test_the_result_owns_its_memory():
    image = np.full((20, 30, 3), 50, np.uint8)
    before = Sampling.for_shape((20, 30), None, 0.0).planes(image, None)
    Sampling.for_shape((20, 30), None, 0.0).planes(image + np.uint8(100), None)
    assert all((plane == 50).all() for plane in before)


def test_the_surface_next_to_a_marker_is_kept():
    rows, columns = np.indices((96, 96), np.float32)
    surface = (100 + 40 * np.sin(rows / 6) * np.cos(columns / 6))[..., None]
    marker_mask = np.zeros((96, 96), bool)
    marker_mask[8:88, 41:44] = True  # a coarse pixel next to it is half marker, half gel surface
    sampling = Sampling.for_shape((96, 96), marker_mask, 2.0)
    (seen,) = sampling.planes(np.where(marker_mask[..., None], np.float32(0), surface), marker_mask)
    (bare,) = sampling.planes(surface, None)
    error = (seen - bare)[6:42]
    assert np.sqrt(np.mean(np.square(error[:, 20:22]))) < 8
