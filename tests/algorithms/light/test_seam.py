"""A seam is a step between two rows that no row nearby has."""

import numpy as np
import pytest

from tactile_core.algorithms.light.seam import find_seam

ROWS, COLUMNS = 120, 40


def noise(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 2, (ROWS, COLUMNS, 3)).astype(np.float32)


@pytest.mark.parametrize("row", [1, 5, 60, 119])
def test_the_first_row_of_the_other_image_is_found(row: int) -> None:
    change = noise()
    change[row:] += 12
    found, strength = find_seam(change)
    assert found == row
    assert strength > 2


def test_noise_and_smooth_relief_have_no_seam() -> None:
    relief = 60 * np.sin(np.linspace(0, 12, ROWS, dtype=np.float32))[:, None, None]
    for seed in range(20):
        assert find_seam(noise(seed) + relief)[1] < 1.4


@pytest.mark.parametrize("period", [2, 8, 16])
def test_the_blocks_of_a_compressed_image_are_no_seams(period: int) -> None:
    blocks = 12 * np.random.default_rng(1).choice([-1, 1], (ROWS // period + 1, COLUMNS, 3))
    change = noise() + np.repeat(blocks, period, axis=0)[:ROWS].astype(np.float32)
    assert find_seam(change)[1] < 1.4


def test_an_image_without_enough_rows_has_none() -> None:
    assert find_seam(noise()[:20])[1] == 0
