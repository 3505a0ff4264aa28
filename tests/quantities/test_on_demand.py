"""Fields that are computed when somebody reads them."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tactile_core.quantities import Float32, Gradients, HeightMap, Quantity
from tactile_core.quantities.array_form import form_fault
from tactile_core.quantities.quantity import grid_of, on_demand, on_grid, replace_values

SHAPE = (7, 9)


def plane(shape: tuple[int, int]) -> Float32:
    """Return a surface that linear interpolation reproduces, in units of pixels."""
    y, x = np.indices(shape, np.float32)
    return np.asarray(0.5 * x + 0.25 * y, np.float32)


def height(calls: list[int] | None = None) -> HeightMap:
    """Return a height map on cells of two pixels, and its validity on demand."""

    def valid() -> np.ndarray:
        if calls is not None:
            calls.append(1)
        return np.ones(SHAPE, np.bool_)

    # cell (0, 0) is centred half a pixel right of and below pixel (0, 0)
    cells = 2 * plane((4, 5)) + np.float32(0.375)
    return HeightMap(on_grid(cells, 2, SHAPE), on_demand(valid), 0.1)


def test_a_field_on_a_grid_is_interpolated_to_the_image_when_it_is_read() -> None:
    inside = np.s_[1:-1, 1:-1]
    assert height().mm.shape == SHAPE
    np.testing.assert_allclose(height().mm[inside], plane(SHAPE)[inside], atol=1e-6)


def test_a_field_is_computed_once_and_only_when_it_is_read() -> None:
    calls: list[int] = []
    made = height(calls)
    assert grid_of(made, "mm").step_px == 2
    assert not calls
    assert made.valid is made.valid
    assert len(calls) == 1


def test_what_is_computed_is_read_only_like_every_array() -> None:
    with pytest.raises(ValueError, match="read-only"):
        height().mm[0, 0] = 1


def test_the_grid_stays_known_after_reading() -> None:
    made = height()
    assert made.mm is not None
    grid = grid_of(made, "mm")
    assert grid.cells.shape == (4, 5)
    assert grid.shape == SHAPE


def test_a_field_that_was_given_as_an_image_is_its_own_grid() -> None:
    image = plane(SHAPE)
    made = HeightMap(image, np.ones(SHAPE, np.bool_), 0.1)
    cells, step_px, shape, _ = grid_of(made, "mm")
    assert step_px == 1
    assert shape == SHAPE
    np.testing.assert_array_equal(cells, image)


def test_copies_with_other_values_keep_what_is_on_demand() -> None:
    calls: list[int] = []
    later = replace_values(height(calls), timestamp_s=2.0)
    assert later.timestamp_s == 2.0
    assert not calls
    np.testing.assert_array_equal(later.mm, height().mm)
    np.testing.assert_array_equal(replace(height(), timestamp_s=2.0).mm, later.mm)


def test_it_pickles_with_its_arrays_and_its_grid() -> None:
    again = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(height()))))
    np.testing.assert_array_equal(again.mm, height().mm)
    assert again.valid.all()
    assert grid_of(again, "mm").step_px == 2
    np.testing.assert_array_equal(replace_values(again, timestamp_s=1.0).mm, height().mm)
    with pytest.raises(AttributeError, match="no attribute"):
        _ = again.metres


def test_files_hold_the_image() -> None:
    assert height().arrays()["height_mm"].shape == SHAPE


def test_values_that_are_not_finite_are_found_on_the_grid() -> None:
    cells = np.full((4, 5), np.nan, np.float32)
    bad = HeightMap(on_grid(cells, 2, SHAPE), on_demand(lambda: np.ones(SHAPE, np.bool_)), 0.1)
    assert "not finite" in form_fault(bad, SHAPE)
    assert form_fault(height(), SHAPE) == ""


def test_a_grid_larger_than_its_image_is_a_fault() -> None:
    cells = np.zeros((40, 50), np.float32)
    bad = HeightMap(on_grid(cells, 2, SHAPE), np.ones(SHAPE, np.bool_), 0.1)
    assert "has the shape" in form_fault(bad, SHAPE)


def test_an_attribute_that_does_not_exist_is_named() -> None:
    with pytest.raises(AttributeError, match="'HeightMap' object has no attribute 'metres'"):
        _ = height().metres  # type: ignore[attr-defined]


def test_a_field_with_a_default_is_refused_on_demand() -> None:
    @dataclass(frozen=True, eq=False)
    class Level(Quantity):
        mm: Float32 | None = None

    with pytest.raises(TypeError, match="mm has a default"):
        Level(on_demand(lambda: plane(SHAPE)))


def test_standard_deviations_wait_too() -> None:
    calls: list[int] = []

    def std() -> Float32:
        calls.append(1)
        return np.full((2, 3), 0.1, np.float32)

    slopes = Gradients(
        plane(SHAPE), plane(SHAPE), np.ones(SHAPE, np.bool_), 0.1, std_cells=on_demand(std)
    )
    assert form_fault(slopes, SHAPE) == ""
    assert not calls
    assert slopes.std is not None
    assert slopes.std.shape == SHAPE


def test_a_quantity_is_shown_without_its_arrays_and_without_computing_them() -> None:
    calls: list[int] = []
    made = height(calls)
    assert repr(made).startswith("HeightMap(mm=<computed when read>, valid=<computed when read>")
    assert not calls
    assert "valid=<7×9 bool>" in repr(replace(made, valid=made.valid))


def test_the_arrays_of_a_pickled_quantity_are_read_only() -> None:
    made = pickle.loads(pickle.dumps(height()))
    assert not made.mm.flags.writeable
    assert not made.valid.flags.writeable
