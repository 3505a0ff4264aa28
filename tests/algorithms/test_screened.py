"""The screened Poisson equation: analytic solutions and limits."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.poisson.screened import solve_screened

SHAPE = (24, 32)


def laplacian(z: np.ndarray) -> np.ndarray:
    padded = np.pad(z, 1, mode="edge")
    neighbours = padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]
    return np.asarray(neighbours - 4 * z)


def test_an_even_weight_damps_each_cosine_by_its_own_factor() -> None:
    k, weight = 3, 0.2
    wave = np.cos(np.pi * k * (np.arange(SHAPE[1]) + 0.5) / SHAPE[1]) * np.ones(SHAPE)
    factor = weight / (weight + 2 - 2 * np.cos(np.pi * k / SHAPE[1]))
    found = solve_screened(weight * wave, np.full(SHAPE, weight))
    assert found == pytest.approx(factor * wave, abs=1e-9)


def test_an_uneven_weight_is_solved_to_the_tolerance() -> None:
    rng = np.random.default_rng(0)
    weight = np.where(rng.random(SHAPE) < 0.4, 0.0, 0.3)
    source = weight * rng.normal(size=SHAPE)
    z = solve_screened(source, weight)
    residual = weight * z - laplacian(z) - source
    assert np.linalg.norm(residual) < 5e-3 * np.linalg.norm(source)


def test_without_weight_and_source_nothing_is_solved() -> None:
    assert not solve_screened(np.zeros(SHAPE), np.zeros(SHAPE)).any()
