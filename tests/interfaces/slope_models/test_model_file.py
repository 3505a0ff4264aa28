"""Saving and loading the arrays of a slope model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.errors import CalibrationError
from tactile_core.interfaces.slope_models.model_file import (
    arrays_of,
    part_from,
    stored_model,
    write_model,
)

SHAPE = (9, 12, 3)


@dataclass(frozen=True, eq=False)
class Line:
    slope: NDArray[np.float32]
    level: float


LINE = Line(np.array([1, 2], np.float32), 0.1)


def test_a_part_is_restored_with_its_arrays_and_numbers(tmp_path: Path) -> None:
    write_model(tmp_path, SHAPE, arrays_of(LINE))
    with stored_model(tmp_path) as (shape, arrays):
        line = part_from(Line, arrays)
    assert shape == SHAPE
    np.testing.assert_array_equal(line.slope, LINE.slope)
    assert type(line.level) is float
    assert line.level == LINE.level


@pytest.mark.parametrize("level", [np.zeros(2), None])
def test_a_part_with_missing_or_misshapen_values_is_rejected(
    tmp_path: Path, level: NDArray[np.float64] | None
) -> None:
    arrays = {name: array for name, array in arrays_of(LINE).items() if name != "level"}
    write_model(tmp_path, SHAPE, arrays if level is None else arrays | {"level": level})
    refusal = pytest.raises(CalibrationError, match=r"hold such a model; calibrate again")
    with refusal, stored_model(tmp_path) as (_, read):
        part_from(Line, read)


@pytest.mark.parametrize("shape", [(np.inf, 9, 3), (0, 9, 3), (9, 9)])
def test_an_impossible_image_shape_is_rejected(tmp_path: Path, shape: Any) -> None:
    write_model(tmp_path, shape, arrays_of(LINE))
    refusal = pytest.raises(CalibrationError, match=r"hold such a model; calibrate again")
    with refusal, stored_model(tmp_path):
        pass
