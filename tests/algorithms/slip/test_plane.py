"""Fields of displacement on the coarse plane of slip."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import as_complex
from tactile_core.algorithms.slip.plane import (
    coarse,
    displacement_since,
    positions_mm,
    stride_of,
)

SPACING_MM = 0.22
SHAPE = (60, 80)
PLACE = positions_mm(SHAPE, SPACING_MM)


def test_since_compares_the_same_surface_points() -> None:
    # a field that varies in space is shifted by many grid points
    def of_gel(surface: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(0.05 * np.sin(surface.real) + 0.03j * np.cos(surface.imag / 2))

    shift = 0.5 - 0.3j
    surface = PLACE.copy()
    for _ in range(20):
        surface = PLACE - of_gel(surface)
    before = of_gel(surface).astype(np.complex64)
    surface = PLACE - shift
    for _ in range(20):
        surface = PLACE - shift - of_gel(surface)
    now = (shift + of_gel(surface)).astype(np.complex64)
    inside = np.s_[8:-8, 8:-8]
    moved = displacement_since(now, before, SPACING_MM)
    np.testing.assert_allclose(moved[inside], np.full_like(moved[inside], shift), atol=2e-3)


@pytest.mark.parametrize("cells", [(48, 64), (480, 640)], ids=["cells", "pixels"])
def test_a_field_is_sampled_in_the_middle_of_each_block(cells: tuple[int, int]) -> None:
    rows, columns = ((np.arange(count) + 0.5) / count for count in cells)
    field = np.stack(np.broadcast_arrays(columns, -rows[:, None]), axis=2).astype(np.float32)
    small = as_complex(coarse(field, (480, 640), stride_of(640)))
    assert small.shape == SHAPE
    at_x, at_y = ((np.arange(4, side, 8) + 0.5) / side for side in (640, 480))
    inner = np.s_[1:-1, 1:-1]
    np.testing.assert_allclose(small[inner], (at_x - 1j * at_y[:, None])[inner], atol=1e-5)
