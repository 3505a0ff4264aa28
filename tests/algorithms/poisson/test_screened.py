"""The screened Poisson equation on few cells: cosines, of which it keeps a known share."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.poisson.screened import cosines, solve_screened

COARSE = (24, 32)


def test_an_even_weight_damps_each_cosine_by_its_own_factor() -> None:
    k, weight = 3, 0.2
    wave = np.cos(np.pi * k * (np.arange(COARSE[1]) + 0.5) / COARSE[1]) * np.ones(COARSE)
    factor = weight / (weight + 2 - 2 * np.cos(np.pi * k / COARSE[1]))
    found = solve_screened(weight * wave, np.full(COARSE, weight))
    assert found == pytest.approx(factor * wave, abs=1e-8)


def test_an_uneven_weight_is_solved_to_a_hundredth() -> None:
    rng = np.random.default_rng(0)
    weight = np.where(rng.random(COARSE) < 0.4, 0.0, 0.3)
    source = weight * rng.normal(size=COARSE)
    z = solve_screened(source, weight)
    padded = np.pad(z, 1, mode="edge")
    neighbours = padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]
    left = weight * z - (neighbours - 4 * z) - source
    assert np.linalg.norm(left) < 1e-2 * np.linalg.norm(source)


def test_without_weight_and_source_nothing_is_solved() -> None:
    assert not solve_screened(np.zeros(COARSE), np.zeros(COARSE)).any()


@pytest.mark.parametrize("margin", [0, 3])
def test_cosines_are_a_basis_of_the_cells_in_view(margin: int) -> None:
    waves, wave_numbers = cosines(8, margin)
    assert waves.shape == (8 + 2 * margin, 8)
    assert waves.T @ waves == pytest.approx(np.eye(8), abs=1e-12)
    assert wave_numbers[0] == 0
    assert wave_numbers[-1] < np.pi
