"""The undeformed area, and the error of the height that it reveals: analytic surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.algorithms.levelling import rest_plane
from tactile_core.algorithms.poisson import integrate
from tactile_core.algorithms.rest_area import height_error, rest_area

SHAPE, MM_PER_PX = (240, 320), 0.06
Map = NDArray[np.float64]


def places() -> tuple[Map, Map]:
    rows, columns = SHAPE
    y, x = np.mgrid[:rows, :columns] * MM_PER_PX
    return x, y


def paraboloid(x_mm: float, y_mm: float, depth_mm: float = 0.5, radius_mm: float = 1.5) -> Map:
    x, y = places()
    square = ((x - x_mm) ** 2 + (y - y_mm) ** 2) / radius_mm**2
    return np.asarray(depth_mm * np.maximum(1 - square, 0))


def plateau(x_mm: float, y_mm: float, depth_mm: float, half_mm: float, wall_mm: float) -> Map:
    x, y = places()
    apart = np.maximum(abs(x - x_mm), abs(y - y_mm))
    return np.asarray(depth_mm * np.clip((half_mm + wall_mm - apart) / wall_mm, 0, 1))


def swell(size_mm: float) -> Map:
    """A smooth wave over the whole image, as slopes that are slightly wrong leave it."""
    x, y = places()
    return np.asarray(size_mm * np.cos(x / 2.9 + 0.4) * np.cos(y / 2.3 - 0.3))


def levelled(truth: Map, error: Map) -> Map:
    """Integrate the slopes of truth plus error, and remove the error that is found."""
    gy, gx = (g.astype(np.float32) for g in np.gradient(truth + error, MM_PER_PX))
    height = integrate(gx, gy, mm_per_px=MM_PER_PX)
    plane = rest_plane(height, gx, gy, mm_per_px=MM_PER_PX)
    height = plane.removed_from(height, MM_PER_PX)
    tilt = plane.slope_x, plane.slope_y
    return np.asarray(height - height_error(height, gx, gy, mm_per_px=MM_PER_PX, tilt=tilt))


WIDE = {"interior": (9.0, 7.0), "side": (0.4, 7.0), "top": (10.0, 0.0), "corner": (18.8, 14.1)}


@pytest.mark.parametrize("place", WIDE.values(), ids=WIDE)
def test_a_paraboloid_keeps_its_height_where_the_border_cuts_it(place: tuple[float, float]) -> None:
    truth = paraboloid(*place)
    height = levelled(truth, np.zeros(SHAPE))
    assert np.abs(height - truth).max() < 0.02 * 0.5


@pytest.mark.parametrize("place", WIDE.values(), ids=WIDE)
def test_smooth_errors_vanish_far_from_a_contact_at_the_border_too(
    place: tuple[float, float],
) -> None:
    truth, error = paraboloid(*place), swell(0.05)
    x, y = places()
    far = np.hypot(x - place[0], y - place[1]) > 3 * 1.5
    height = levelled(truth, error)
    assert np.sqrt(np.mean(height[far] ** 2)) < 0.55 * error[far].std()
    assert np.abs((height - truth)[truth > 0]).mean() < np.abs(error).max()


@pytest.mark.parametrize("size_mm", [0.02, 0.08])
def test_a_wave_over_undeformed_gel_is_an_error(size_mm: float) -> None:
    # by the decay of 1.5 mm the wave keeps k² / (k² + 1 / decay²) = 0.41 of its height
    left = levelled(np.zeros(SHAPE), swell(size_mm))
    assert left.std() < 0.5 * swell(size_mm).std()
    assert np.abs(left).max() < 0.6 * size_mm


def test_a_flat_object_stays_raised_where_shear_has_flattened_its_wall() -> None:
    depth_mm, slope, right_mm = 0.075, 0.03, 12.0
    x, _ = places()
    # on its right side the gel descends by less than the slope of calm cells
    ramp = np.clip(depth_mm - slope * (x - right_mm), 0, depth_mm)
    outline = plateau(6.5, 7.2, 1.0, 5.5, 0.3), plateau(right_mm, 7.2, 1.0, 5.5, 0.3)
    truth = np.where(x < right_mm, depth_mm * outline[0], ramp * outline[1])
    height = levelled(truth, np.zeros(SHAPE))
    top = (truth == depth_mm) & (x < right_mm - 1)
    assert height[top].mean() == pytest.approx(depth_mm, rel=0.1)


@pytest.mark.parametrize("depth_mm", [0.06, 0.3])
def test_the_flat_top_of_a_shallow_object_stays_raised_next_to_a_deep_one(depth_mm: float) -> None:
    low = plateau(5.0, 7.0, depth_mm, 2.0, 0.3)
    height = levelled(low + paraboloid(14.0, 7.0, 0.8), np.zeros(SHAPE))
    top = low == depth_mm
    assert height[top].mean() == pytest.approx(depth_mm, abs=0.1 * depth_mm)


def test_a_flat_top_that_fills_half_of_the_image_stays_raised() -> None:
    truth = plateau(3.0, 7.0, 0.4, 6.0, 0.3)
    height = levelled(truth, np.zeros(SHAPE))
    assert height[truth == 0.4].mean() == pytest.approx(0.4, rel=0.03)


def test_calm_parts_are_undeformed_if_the_surface_rises_at_their_rim() -> None:
    height = plateau(9.0, 7.0, 0.4, 2.5, 1.0)[::8, ::8]
    gy, gx = np.gradient(height, 8 * MM_PER_PX)
    found = rest_area(height, gx, gy)
    assert found[[0, -1], [0, -1]].all()
    assert not found[height > 0.1].any()


def test_the_bulge_next_to_a_contact_keeps_most_of_its_depth() -> None:
    x, y = places()
    apart = np.hypot(x - 9.0, y - 7.0)
    bulge = -0.04 * np.exp(-np.square((apart - 2.6) / 0.8))
    truth = paraboloid(9.0, 7.0, 0.5, 1.6) + bulge
    height = levelled(truth, np.zeros(SHAPE))
    ring = np.abs(apart - 2.6) < 0.1
    assert height[ring].mean() < 0.6 * bulge[ring].mean()
    assert height.max() == pytest.approx(truth.max(), rel=0.02)


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (3, 5)])
def test_tiny_images_have_an_error(shape: tuple[int, int]) -> None:
    flat = np.zeros(shape, np.float32)
    assert height_error(flat, flat, flat, mm_per_px=0.1).shape == shape
