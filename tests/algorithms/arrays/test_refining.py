"""Cells of half the side: cubic surfaces are exact, and a peak keeps its height."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.arrays.shrinking import interpolate_cells, refine_cells


def centres(count: int, side: float) -> np.ndarray:
    return (np.arange(count) + 0.5) * side


def test_a_cubic_surface_is_exact_inside() -> None:
    def surface(side: float) -> np.ndarray:
        y, x = centres(int(16 / side), side)[:, None] - 8, centres(int(24 / side), side) - 9
        return np.asarray(y**3 / 50 - x * y / 4 + x**3 / 90 + 1, np.float32)

    fine = refine_cells(surface(1.0))
    assert fine[4:-4, 4:-4] == pytest.approx(surface(0.5)[4:-4, 4:-4], abs=1e-4)


def test_the_border_continues_with_the_last_cell() -> None:
    assert refine_cells(np.full((3, 5), 2, np.float32)) == pytest.approx(2.0)


def test_a_peak_between_cells_keeps_its_height() -> None:
    y, x = centres(12, 4.0)[:, None] - 24, centres(16, 4.0) - 32
    cells = np.asarray(np.exp(-(x**2 + y**2) / (2 * 8.0**2)), np.float32)
    assert interpolate_cells(refine_cells(cells), 2, (48, 64)).max() == pytest.approx(
        1.0, abs=0.025
    )
    assert interpolate_cells(cells, 4, (48, 64)).max() < 0.945
