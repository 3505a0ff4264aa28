"""Heights relative to the undeformed surface: surfaces of known error."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support.elastic_surface import Object, ball, indent, plate

from tactile_core.algorithms.heights.levelling import (
    find_undeformed,
    set_to_rest,
)
from tactile_core.algorithms.poisson import integrate

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


def levelled(shape_mm: Map, **options: float) -> Map:
    """Integrate the slopes of a surface, and set it to rest."""
    gy, gx = (g.astype(np.float32) for g in np.gradient(shape_mm, MM_PER_PX))
    height = integrate(gx, gy, mm_per_px=MM_PER_PX)
    set_to_rest(height, gx, gy, mm_per_px=MM_PER_PX, **options)  # type: ignore[arg-type]
    return np.asarray(height, float)


def pressed(*objects: Object) -> Map:
    """Surface of the gel under rigid objects."""
    return indent(*objects, shape=SHAPE, mm_per_px=MM_PER_PX)


WIDE = {"interior": (9.0, 7.0), "side": (0.4, 7.0), "top": (10.0, 0.0), "corner": (18.8, 14.1)}


@pytest.mark.parametrize("place", WIDE.values(), ids=WIDE)
def test_gel_around_a_ball_keeps_its_shape_where_the_border_cuts_it(
    place: tuple[float, float],
) -> None:
    truth = pressed(ball(*place, 0.4, 2.5))
    assert truth.min() < -0.015  # it bulges
    assert np.abs(levelled(truth) - truth).max() < 0.035 * 0.4


@pytest.mark.parametrize("place", WIDE.values(), ids=WIDE)
def test_smooth_errors_vanish_far_from_a_contact_at_the_border_too(
    place: tuple[float, float],
) -> None:
    truth, error = pressed(ball(*place, 0.4, 2.5)), swell(0.05)
    x, y = places()
    apart = np.hypot(x - place[0], y - place[1])
    far = apart > 3 * 1.5
    wrong = levelled(truth + error) - truth
    assert np.sqrt(np.mean(wrong[far] ** 2)) < 0.55 * error[far].std()
    assert np.abs(wrong[apart < 1.5]).mean() < np.abs(error).max()


@pytest.mark.parametrize("size_mm", [0.02, 0.08])
def test_a_wave_over_undeformed_gel_is_an_error(size_mm: float) -> None:
    # by the decay of 1.5 mm the wave keeps k² / (k² + 1 / decay²) = 0.41 of its height
    left = levelled(swell(size_mm))
    assert left.std() < 0.5 * swell(size_mm).std()
    assert np.abs(left).max() < 0.6 * size_mm


def test_a_flat_object_stays_raised_where_shear_has_flattened_its_wall() -> None:
    depth_mm, slope, right_mm = 0.075, 0.03, 12.0
    x, _ = places()
    # on its right side the gel descends by less than the slope of calm cells
    ramp = np.clip(depth_mm - slope * (x - right_mm), 0, depth_mm)
    outline = plateau(6.5, 7.2, 1.0, 5.5, 0.3), plateau(right_mm, 7.2, 1.0, 5.5, 0.3)
    truth = np.where(x < right_mm, depth_mm * outline[0], ramp * outline[1])
    height = levelled(truth)
    top = (truth == depth_mm) & (x < right_mm - 1)
    # the gel of this drawing does not bulge, which counts as an error
    assert height[top].mean() == pytest.approx(depth_mm, rel=0.2)


@pytest.mark.parametrize("depth_mm", [0.06, 0.3])
def test_the_flat_top_of_a_shallow_object_stays_raised_next_to_a_deep_one(depth_mm: float) -> None:
    truth = pressed(plate(5.0, 7.0, depth_mm, 2.0), ball(14.0, 7.0, 0.8, 2.0))
    top = plate(5.0, 7.0, 1.0, 1.8)(*places()) > 0
    assert levelled(truth)[top].mean() == pytest.approx(depth_mm, rel=0.1)


def test_a_shallow_plate_stays_raised_next_to_a_higher_smooth_error() -> None:
    x, y = places()
    truth = pressed(plate(4.5, 7.2, 0.06, 3.5))
    hill = 0.25 * np.exp(-((x - 17) ** 2 + (y - 7) ** 2) / (2 * 4.0**2))
    top = plate(4.5, 7.2, 1.0, 3.2)(x, y) > 0
    assert levelled(truth + hill)[top].mean() == pytest.approx(0.06, rel=0.25)


def test_a_flat_top_that_fills_half_of_the_image_stays_raised() -> None:
    truth = pressed(plate(3.0, 7.0, 0.4, 6.0))
    top = plate(3.0, 7.0, 1.0, 5.7)(*places()) > 0
    # none of the gel in view is undeformed
    assert levelled(truth)[top].mean() == pytest.approx(0.4, rel=0.3)


def test_low_calm_cells_are_undeformed() -> None:
    height = plateau(9.0, 7.0, 0.4, 2.5, 1.0)[::8, ::8]
    gy, gx = np.gradient(height, 8 * MM_PER_PX)
    found = find_undeformed(height, np.hypot(gx, gy))
    assert found[[0, -1], [0, -1]].all()
    assert not found[height > 0.1].any()


def test_a_plate_that_covers_the_view_keeps_its_groove() -> None:
    groove = np.clip((abs(places()[0] - 9.0) - 0.6) / 0.3, 0, 1)
    row = levelled(0.4 * groove)[120]
    assert (row[125] + row[175]) / 2 - row[150] == pytest.approx(0.4, rel=0.01)


PRESS = pressed(ball(9.0, 7.0, 0.4, 2.5))
X, Y = places()


@pytest.mark.parametrize("correct", [True, False])
def test_level_and_drift_vanish_and_the_contact_keeps_its_height(correct: bool) -> None:
    found = levelled(PRESS + 3 + 0.02 * X - 0.01 * Y, levelled=correct)
    np.testing.assert_allclose(found, PRESS, atol=0.01)


def test_a_tilt_too_steep_for_drift_stays() -> None:
    found = levelled(PRESS + 0.02 * X, drift_slope=0.0, levelled=False)
    tilt = np.diff(found - PRESS, axis=1)[Y[:, 1:] > 10]
    np.testing.assert_allclose(tilt, 0.02 * MM_PER_PX, atol=5e-5)


def test_a_smooth_error_stays_unless_it_is_levelled() -> None:
    assert levelled(swell(0.02)).std() < 0.6 * levelled(swell(0.02), levelled=False).std()


def test_an_error_vanishes_over_a_length_in_proportion_to_the_thickness() -> None:
    left = [levelled(swell(0.02), thickness_mm=thickness).std() for thickness in (1.0, 2.0, 4.0)]
    assert left[0] < 0.6 * left[1] < 0.6 * left[2]


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (3, 5)])
def test_tiny_images_can_be_levelled(shape: tuple[int, int]) -> None:
    height = np.full(shape, 0.4, np.float32)
    set_to_rest(height, np.zeros_like(height), np.zeros_like(height), mm_per_px=0.1)
    assert height == pytest.approx(np.zeros(shape), abs=1e-6)
